"""The list of docks: where each begins, and what makes its content."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Literal

from PySide6.QtWidgets import QWidget

from studio.app.model.workbench import Workbench

Side = Literal["left", "right", "bottom"]


@dataclass(frozen=True, slots=True)
class Dock:
    """One dock.

    Attributes:
        id: names it in layouts and actions.
        title: on its tab.
        icon: of its tab.
        side: where it begins; docks of one side are tabs of one another.
        content: `module:Class` or a function, called with the bench when the dock is first shown.
        hint: what it is for.
        keys: shows it.
    """

    id: str
    title: str
    icon: str
    side: Side
    content: str
    hint: str
    keys: str


DOCKS = (
    Dock(
        "twin",
        "Twin",
        "mdi6.cube-scan",
        "left",
        "studio.app.twin.dock:TwinDock",
        "objects, people, cameras and notes of the room; move, add, remove",
        "Ctrl+1",
    ),
    Dock(
        "sessions",
        "Sessions",
        "mdi6.history",
        "left",
        "studio.app.timeline.sessions_dock:SessionsDock",
        "sessions that were recorded: open, show the folder, delete, bring back",
        "Ctrl+8",
    ),
    Dock(
        "scenario",
        "Scenario",
        "mdi6.script-text-outline",
        "right",
        "studio.app.scenario.dock:ScenarioDock",
        "what people do in a rehearsal, and what goes wrong",
        "Ctrl+2",
    ),
    Dock(
        "session",
        "Session",
        "mdi6.access-point",
        "right",
        "studio.app.devices.dock:SessionDock",
        "devices, checks before the start, delays, log and report",
        "Ctrl+3",
    ),
    Dock(
        "live",
        "Live",
        "mdi6.broadcast",
        "right",
        "studio.app.live.dock:LiveDock",
        "a real 360° camera: connect, check, go live, end",
        "Ctrl+7",
    ),
    Dock(
        "people",
        "People",
        "mdi6.account-group-outline",
        "right",
        "studio.app.people.dock:PeopleDock",
        "people in the live session: let them in, a code for each, who is here, what they may",
        "Ctrl+0",
    ),
    Dock(
        "preparation",
        "Preparation",
        "mdi6.image-multiple-outline",
        "right",
        "studio.app.preparation.dock:PreparationDock",
        "a room from a video or photos, and its movable objects",
        "Ctrl+4",
    ),
    Dock(
        "sweeps",
        "Sweeps",
        "mdi6.chart-scatter-plot",
        "right",
        "studio.app.scenario.sweeps_dock:SweepsDock",
        "the scenario with faults of every size: start, watch, read the table, open a run",
        "Ctrl+9",
    ),
    Dock(
        "timeline",
        "Timeline",
        "mdi6.chart-timeline-variant",
        "bottom",
        "studio.app.timeline.actions:make_timeline",
        "recorded sessions: go to any instant, see errors, fork, compare",
        "Ctrl+5",
    ),
    Dock(
        "keys",
        "Keys",
        "mdi6.keyboard-outline",
        "right",
        "studio.app.shell.keys.key_editor:KeyEditor",
        "which keys do what",
        "Ctrl+6",
    ),
)

CLOSED_AT_FIRST = frozenset({"keys", "sweeps"})
"""Docks that a first window does not show."""


def make_content(dock: Dock, bench: Workbench) -> QWidget:
    """Make the content of a dock."""
    module, _, name = dock.content.partition(":")
    made = getattr(importlib.import_module(module), name)(bench)
    assert isinstance(made, QWidget)
    return made
