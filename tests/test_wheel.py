"""What is published holds all that an installed program reads."""

from __future__ import annotations

import importlib.util
import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from studio.console import program_files
from studio.web.web_files import LICENCES, is_complete

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = ROOT / "release" / "build.py"
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PYPROJECT["tool"]["maturin"]["python-packages"]
build = SimpleNamespace(**runpy.run_path(str(SCRIPT)))


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The copy that wheels are built of."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("the copy holds what Git knows, and this is no checkout")
    folder = tmp_path_factory.mktemp("sources")
    build.copy_sources(ROOT, folder)
    return folder


def test_a_checkout_reads_its_own_files() -> None:
    assert program_files.IS_CHECKOUT
    assert program_files.PROGRAM_FILES == ROOT


def test_every_data_file_of_the_packages_is_in_the_copy(sources: Path) -> None:
    """What a glob or a name in the code finds in the checkout, it finds when installed."""
    ignored = {".pyc", ".so", ".pyd"}
    for package in PACKAGES:
        here = [path for path in (ROOT / package).rglob("*") if path.is_file()]
        for path in here:
            inside = path.relative_to(ROOT)
            if path.suffix not in ignored and "bundled" not in inside.parts:
                assert (sources / inside).is_file(), f"Git does not know {inside}"


def test_only_the_floors_are_published(sources: Path) -> None:
    assert PACKAGES == ["scenes", "devices", "sim", "tracking", "studio"]
    assert PYPROJECT["tool"]["maturin"]["include"] == [f"{build.BUNDLED}/**/*"]
    assert not (sources / "web" / "node_modules").exists()
    assert not (sources / build.BUNDLED).exists(), "made for each wheel, never kept"


def test_bundled_files_hold_manual_licence_and_viewer(tmp_path: Path) -> None:
    if not is_complete(ROOT / "web"):
        pytest.skip("the viewer's libraries are not here: no network when the launcher ran")

    build.bundle(ROOT, tmp_path)

    assert is_complete(tmp_path / "web")
    for package in LICENCES:
        assert "MIT" in (tmp_path / "web" / "node_modules" / package / "LICENSE").read_text()
    assert (tmp_path / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()
    for page in (ROOT / "docs").rglob("*.md"):
        text = (tmp_path / page.relative_to(ROOT)).read_text(encoding="utf-8")
        for picture in re.findall(r"!\[[^\]]*\]\(([^)#:]+)\)", text):
            assert (tmp_path / page.relative_to(ROOT).parent / picture).is_file(), picture


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_an_empty_environment_rehearses(tmp_path: Path) -> None:
    """Wheel, empty environment, empty folder: a rehearsal to its end, handed over."""
    if importlib.util.find_spec("maturin") is None or shutil.which("cargo") is None:
        pytest.skip("maturin or Rust is missing")
    if not (ROOT / ".git").exists():
        pytest.skip("the copy holds what Git knows, and this is no checkout")
    subprocess.run([sys.executable, SCRIPT, "--here", "--out", tmp_path / "dist"], check=True)
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert not [name for name in names if name.startswith(("tests/", "benchmarks/", "docs/"))]
    assert f"{build.BUNDLED}/web/package-lock.json" in names

    python = tmp_path / "env" / "bin" / "python"
    venv.create(tmp_path / "env", with_pip=True)
    words = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel]
    installed = subprocess.run(words, capture_output=True, text=True, check=False)
    if installed.returncode != 0:
        pytest.skip(f"no network: {installed.stderr.strip().splitlines()[-1]}")
    empty = tmp_path / "empty"
    empty.mkdir()

    def nexus(*arguments: str) -> subprocess.CompletedProcess[str]:
        environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "DISPLAY")}
        command = [python.with_name("nexus"), *arguments]
        return subprocess.run(
            command, cwd=empty, env=environment, capture_output=True, text=True, check=False
        )

    short = ("--headless", "--scenario", "lab-short", "--no-paper", "--out", "demo")
    done = nexus("rehearse", "lab", *short)
    assert (empty / "demo" / "report.html").is_file(), done.stderr
    shared = nexus("share", "demo", "--out", "shared", "--only", "viewer")
    assert shared.returncode == 0, shared.stderr
    studio = nexus("studio")
    assert studio.returncode == 3
    assert "pip install 'gaussiannexus-studio[studio]'" in studio.stderr
