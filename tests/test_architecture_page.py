"""docs/architecture.md names every room of the house, and nothing that is not there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "architecture.md"
PACKAGES = ("scenes", "native/src", "devices", "sim", "tracking", "studio", "benchmarks")
SOURCES = {".py", ".rs", ".toml", ".html"}
NOT_ROOMS = {"scenes/samples/data", "scenes/samples/scans"}
"""Folders of data: light maps and scans."""


def rooms():
    for package in PACKAGES:
        top = ROOT / package
        for folder in (top, *(p for p in top.rglob("*") if p.is_dir())):
            name = folder.relative_to(ROOT).as_posix()
            holds_code = any(f.suffix in SOURCES for f in folder.iterdir() if f.is_file())
            is_data = any(name == data or name.startswith(f"{data}/") for data in NOT_ROOMS)
            if holds_code and "__pycache__" not in name and not is_data:
                yield name


def named(text):
    """Everything in back quotes that looks like a path of the repository."""
    for quoted in re.findall(r"`([^`\s]+)`", text):
        if re.fullmatch(r"[\w.-]+(/[\w.-]+)*/?", quoted) and "/" in quoted:
            yield quoted


@pytest.mark.parametrize("room", sorted(rooms()))
def test_every_room_is_on_the_page(room):
    assert f"`{room}/`" in PAGE.read_text(encoding="utf-8"), (
        f"{room}/ is not on {PAGE.name}: add a line that says what it is for"
    )


@pytest.mark.parametrize("path", sorted(set(named(PAGE.read_text(encoding="utf-8")))))
def test_every_path_on_the_page_exists(path):
    assert (ROOT / path).exists(), f"{PAGE.name} names {path}, which does not exist"


def test_files_named_in_a_room_s_line_are_in_it():
    missing = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        room = re.match(r"\| `([\w/]+)/` \|", line)
        if room is None:
            continue
        for file in re.findall(r"`([\w]+\.(?:py|rs))`", line):
            if not (ROOT / room[1] / file).is_file():
                missing.append(f"{room[1]}/{file}")
    assert not missing
