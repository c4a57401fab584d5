"""Scenes and projects, sessions and scenarios that were opened lately."""

from __future__ import annotations

from pathlib import Path

from scenes.samples import SAMPLE_NAMES
from studio.app.model.actions import Choice
from studio.app.model.settings import Recent, Settings
from studio.session.records.outputs import RECORDING

SHOWN = 8
"""Of each kind: a menu that is taken in at a glance."""

PREFIXES: dict[Recent, str] = {
    "recent": "",
    "recent_sessions": "Session ",
    "recent_scenarios": "Scenario ",
}
"""Words before the name, by kind, in the order of the menu."""


def recent_choices(settings: Settings, shown: int = SHOWN) -> list[Choice]:
    """Everything that can be opened again, with its path for `file.open`; newest first."""
    found: list[Choice] = []
    for kind, prefix in PREFIXES.items():
        paths: tuple[str, ...] = getattr(settings, kind)
        there = [path for path in paths if path in SAMPLE_NAMES or Path(path).exists()]
        found += [Choice(prefix + _name(path), {"path": path}) for path in there[:shown]]
    return found


def _name(path: str) -> str:
    """A name that tells it from others: of a rehearsal, its folder's."""
    if path in SAMPLE_NAMES:
        return path
    file = Path(path)
    folder = file.parent
    return folder.name if file.name == RECORDING else f"{file.name} ({folder.name})"
