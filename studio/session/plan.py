"""Plan of a session: its contents, its trackers and its pace."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from sim.faults.fault import Fault
from studio.session.fork import Fork
from studio.session.trackers.methods import METHODS, NO_MORE, MethodMaker
from tracking.options import TrackerOptions


class Pace(StrEnum):
    """How time passes in a session."""

    EXACT = "exact"
    """On one thread, nothing dropped, as fast as it goes: the same every time."""
    PACED = "paced"
    """In real time: frames that come while the tracker is busy are dropped and counted."""
    LIVE = "live"
    """In a camera's own time: as paced, but what was tracked is marked, so that a replay does the
    same."""


@dataclass(frozen=True, slots=True)
class SessionPlan:
    """Choices that make a session.

    Attributes:
        scene: name of a built-in room or path of a scene package; ignored by a replay.
        scenario: name or path of a scenario, or None for the scene's own; ignored by a replay.
        seed: of everything random in the simulation.
        recording: a recording to play instead of simulating.
        methods: trackers to run, of `METHODS` and `more_methods`; the first is shown.
        pace: how time passes.
        record_to: where to write the recording, or None.
        fork: a recorded simulation to go on with; its scene, seed and methods are given above.
        more_methods: trackers beside `METHODS` by name, such as those of plug-ins.
        more_faults: kinds that the scenario may have beside the built-in ones.
        arranged: tables of what was arranged by hand, which the scenario's text gets at its end.
        options: the tracker's settings to begin with; None for the usual ones, and in a replay for
            those that are recorded, with their changes.
    """

    scene: str = "lab"
    scenario: str | None = None
    seed: int = 0
    recording: Path | None = None
    methods: tuple[str, ...] = METHODS
    pace: Pace = Pace.EXACT
    record_to: Path | None = None
    fork: Fork | None = None
    more_methods: Mapping[str, MethodMaker] = field(default_factory=lambda: NO_MORE)
    more_faults: tuple[type[Fault], ...] = ()
    arranged: str = ""
    options: TrackerOptions | None = None
