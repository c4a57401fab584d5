"""The documentation is built without a warning, and a link that leads nowhere is a fault."""

from __future__ import annotations

import argparse
import importlib
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "docs" / "api" / "build.py"
QUICK = (
    "scenes.cameras",
    "scenes.frames",
    "scenes.render.renderer",
    "sim.scenarios",
    "tracking.output",
)
"""Modules of the quick part: those that the tests and the pages point into. All take a minute."""


def build(out: Path, *modules: str) -> subprocess.CompletedProcess[str]:
    only = ["--only", *modules] if modules else []
    return subprocess.run(
        [sys.executable, BUILD, out, *only],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(
    scope="module",
    params=[QUICK, pytest.param((), marks=pytest.mark.slow)],
    ids=["some modules", "all modules"],
)
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("docs")
    done = build(out / "out", *request.param)
    assert (done.returncode, done.stderr) == (0, "")
    return out / "out"


def test_every_page_is_there(built: Path) -> None:
    pages = {path.stem for path in built.glob("*.html")}
    wanted = {path.stem for path in (ROOT / "docs").rglob("*.md")}
    assert pages >= wanted | {"index", "contributing", "changelog", "examples"}


def test_pictures_and_files_that_pages_show_are_there(built: Path) -> None:
    for page in built.glob("*.html"):
        for target in re.findall(r'(?:src|href)="([^":#]+)["#]', page.read_text(encoding="utf-8")):
            assert (built / target).exists(), f"{page.name}: {target}"


def test_the_reference_holds_protocols_and_cameras(built: Path) -> None:
    page = (built / "api" / "scenes" / "cameras.html").read_text(encoding="utf-8")
    assert 'id="Fisheye.project"' in page
    assert "pixels per radian" in page
    page = (built / "api" / "tracking" / "output.html").read_text(encoding="utf-8")
    assert 'id="TrackingMethod.step"' in page


def test_links_that_lead_nowhere_are_faults(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = runpy.run_path(str(BUILD))
    (tmp_path / "docs").mkdir()
    (tmp_path / "examples").mkdir()
    for name in names["FIRST_PAGES"]:
        (tmp_path / name).write_text(f"# {name}\n\n[here](#{Path(name).stem.lower()}md)\n")
    (tmp_path / "docs" / "architecture.md").write_text("# A\n[a](b.md) [c](glossary.md#d)\n")
    monkeypatch.setitem(names["build_pages"].__globals__, "ROOT", tmp_path)
    (tmp_path / "out").mkdir()
    faults = names["build_pages"](tmp_path / "out")
    assert faults[0] == "docs/architecture.md: the link 'b.md' leads nowhere"
    assert "docs/architecture.md: glossary.html has no heading '#d'" in faults


def test_what_was_not_made_by_it_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    done = build(tmp_path, "scenes.pose")
    assert done.returncode == 1
    assert "not empty" in done.stderr
    assert (tmp_path / "mine.txt").is_file()


def test_commands_of_the_study_page_are_understood() -> None:
    page = (ROOT / "docs" / "study.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\./nexus (study .+?)(?: +#.*)?$", page, re.MULTILINE)
    lines += re.findall(r"`nexus (study [a-z]+ out/[^`]+)`", page)
    assert len(lines) > 6
    for line in lines:
        words = line.split()
        module = importlib.import_module(f"studio.verbs.{words[0]}.{words[1]}")
        parser = argparse.ArgumentParser(exit_on_error=False, allow_abbrev=False)
        module.add_arguments(parser)
        parser.parse_args(words[2:])
