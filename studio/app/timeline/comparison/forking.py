"""Planning of a fork from the timeline, and the comparison of two runs: work for a thread."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scenes.workers.task import Task
from studio.app.model.documents.document import Document

if TYPE_CHECKING:  # what a session needs takes a second to import
    from scenes.package import ScenePackage
    from sim.faults.fault import Fault
    from sim.scenarios.scenario import Scenario
    from studio.app.timeline.opening import OpenRecording
    from studio.compare.comparison import Comparison
    from studio.session.fork import Fork
    from studio.session.plan import SessionPlan

TOLERANCE = 0.1
"""Share by which a figure of B may be worse than A's: what `nexus compare` takes, too."""


@dataclass(frozen=True, slots=True)
class PlannedFork:
    """A fork that can be played.

    Attributes:
        plan: of its session.
        in_vain: why it would be the recording once more, in words; empty if something is changed.
    """

    plan: SessionPlan
    in_vain: str


def planning_fork(
    recording: Path,
    *,
    at_s: float,
    document: Document,
    scene: ScenePackage | None,
    more_faults: tuple[type[Fault], ...] = (),
) -> Task[PlannedFork]:
    """Begin to plan a session that goes on from an instant with the document's scenario.

    Args:
        recording: of an exact rehearsal, or of a fork of one.
        at_s: the instant, seconds of the session.
        document: whose scenario is followed from then on; without one the session goes on
            unchanged.
        scene: that is open, by which it is estimated when people do what; or None.
        more_faults: kinds of plug-ins that scenarios may have.
    """

    def work(_task: Task[PlannedFork]) -> PlannedFork:
        from studio.session.fork import open_fork
        from studio.session.plan import SessionPlan

        with tempfile.TemporaryDirectory() as folder:
            scenario = document.scenario_name or None
            if document.scenario:
                file = Path(folder) / f"{scenario or 'scenario'}.toml"
                file.write_text(document.scenario, encoding="utf-8")
                scenario = str(file)
            fork = open_fork(recording, at_s=at_s, scenario=scenario, more_faults=more_faults)
        info = fork.info
        assert info.seed is not None
        plan = SessionPlan(scene=info.scene, seed=info.seed, methods=info.methods, fork=fork)
        return PlannedFork(plan, in_vain(fork, scene))

    return Task("planning a fork", work, expected=Exception).start()


def in_vain(fork: Fork, scene: ScenePackage | None) -> str:
    """Why a fork would be the recording once more, in words; empty if something is changed in it.

    Args:
        fork: that is planned.
        scene: by which it is estimated when people do what; without one every change counts.
    """
    from sim.scenarios.switch import first_difference_s

    at_s, follows = fork.t_ns / 1e9, [fork.scenario, *(switch.scenario for switch in fork.then)]
    end_s = follows[-1].duration_s
    same = f"A fork at {at_s:.1f} s would play the same session once more: "
    if not fork.is_changed:
        return f"{same}there is no scenario to go on with. Edit one first (dock Scenario)."
    found_s = first_difference_s(*follows[-2:], from_s=at_s, begins_s=_estimate(scene))
    if found_s is None:
        return (
            f"{same}nothing in the scenario is changed that takes place between then and the end "
            f"at {end_s:.1f} s. Change what comes later, or fork earlier."
        )
    if found_s < end_s:
        return ""
    return (
        f"{same}what is changed comes at {found_s:.1f} s, as far as can be estimated, and the "
        f"session ends at {end_s:.1f} s. Let it come earlier, or last longer."
    )


def _estimate(scene: ScenePackage | None) -> Callable[[Scenario, str, int], float]:
    """When people probably begin their actions; without a scene, at once."""
    from studio.app.scenario.plan import planned, room_plan

    def begins_s(scenario: Scenario, person_id: str, number: int) -> float:
        if plan is None:
            return 0.0
        blocks = [b for b in planned(scenario, plan) if b.person_id == person_id]
        if number < len(blocks):
            return next(block.start_s for block in blocks if block.index == number)
        return max((block.end_s for block in blocks), default=0.0)

    plan = None if scene is None else room_plan(scene, None)
    return begins_s


@dataclass(frozen=True, slots=True, eq=False)
class TwoRuns:
    """A comparison with both runs' recordings.

    Attributes:
        comparison: figures and what they are of.
        recordings: of A and of B.
    """

    comparison: Comparison
    recordings: tuple[OpenRecording, OpenRecording]


def comparing(a: Path, b: Path) -> Task[TwoRuns]:
    """Begin to compare two folders of rehearsals or forks."""

    def work(task: Task[TwoRuns]) -> TwoRuns:
        from studio.app.timeline.opening import open_recording, recording_file
        from studio.app.timeline.recorded.reading import read_index
        from studio.compare.comparison import read_comparison
        from studio.compare.run import what_is_missing

        for folder in (a, b):
            missing = what_is_missing(folder)
            if missing is not None:
                raise ValueError(missing)
        comparison = read_comparison(a, b, tolerance=TOLERANCE)
        opened: list[OpenRecording] = []
        for folder in (a, b):
            index = read_index(
                recording_file(folder), progress=task.report, cancelled=task.cancelled
            )
            if index is None:
                raise ValueError("comparing was cancelled")
            opened.append(open_recording(index, comparison.scene))
        return TwoRuns(comparison, (opened[0], opened[1]))

    return Task("comparing", work, expected=Exception).start()


def writing_page(comparison: Comparison) -> Task[Path]:
    """Begin to write the comparison's page beside B's folder; the result is its path."""

    def work(_task: Task[Path]) -> Path:
        from studio.compare.page import write_comparison

        folder = comparison.b.folder
        path = folder.with_name(f"{folder.name}-compared.html").absolute()
        write_comparison(comparison, path)
        return path

    return Task("writing a page", work, expected=Exception).start()
