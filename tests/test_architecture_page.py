"""docs/architecture.md and docs/rooms.md name what is there, and every room of the house."""

import ast
import re
from pathlib import Path

import pytest

from tests import rooms

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "architecture.md"
SOURCES = {".py", ".rs", ".toml", ".html"}
NOT_ROOMS = {
    "scenes/samples/data",
    "scenes/samples/scans",
    "sim/sweeps",
    "studio/handover/viewer",
    "studio/web/live",
    "studio/web/shared",
}
"""Folders of data: light maps, scans, sweeps, and the exported page's own modules."""
MIN_WORDS = 4
"""Of a room's first sentence: fewer say no more than its name."""


def folders_with_code():
    for floor in rooms.FLOORS:
        top = ROOT / floor
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


def test_the_page_of_rooms_is_what_the_docstrings_say():
    assert rooms.PAGE.read_text(encoding="utf-8") == rooms.page(), (
        "write it anew: python -m tests.rooms"
    )


def test_every_folder_with_code_is_a_room_that_says_what_it_is():
    said = dict(rooms.rooms())
    missing = [n for n in folders_with_code() if len(said.get(n, "").split()) < MIN_WORDS]
    assert not missing, f"no docstring in __init__.py or mod.rs that says what it is: {missing}"


@pytest.mark.parametrize("path", sorted(set(named(PAGE.read_text(encoding="utf-8")))))
def test_every_path_on_the_page_exists(path):
    assert (ROOT / path).exists(), f"{PAGE.name} names {path}, which does not exist"


def test_files_named_in_a_room_s_docstring_are_in_it():
    missing = []
    for init in (p for floor in rooms.FLOORS for p in (ROOT / floor).rglob("__init__.py")):
        said = ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))) or ""
        for file in re.findall(r"`([\w/]+\.(?:py|rs))`", said):
            if not (init.parent / file).is_file():
                missing.append(f"{init.parent.relative_to(ROOT)}/{file}")
    assert not missing
