"""What a fork from the timeline plays, and the comparison of two runs: work for a thread."""

from __future__ import annotations

import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from studio.app.model.documents.document import Document
from studio.app.timeline.task import Report, Task

if TYPE_CHECKING:  # what a session needs takes a second to import
    from sim.faults.fault import Fault
    from studio.app.timeline.opening import OpenRecording
    from studio.compare.comparison import Comparison
    from studio.session.plan import SessionPlan

TOLERANCE = 0.1
"""Share by which a figure of B may be worse than A's: what `nexus compare` takes, too."""


def planning_fork(
    recording: Path,
    *,
    at_s: float,
    document: Document,
    out: Path,
    more_faults: tuple[type[Fault], ...] = (),
) -> Task[SessionPlan]:
    """Begin to plan a session that goes on from an instant with the document's scenario.

    Args:
        recording: of an exact rehearsal, or of a fork of one.
        at_s: the instant, seconds of the session.
        document: whose scenario is followed from then on; without one the session goes on
            unchanged.
        out: folder that the results will go to.
        more_faults: kinds of plug-ins that scenarios may have.
    """

    def work(_report: Report, _cancelled: threading.Event) -> SessionPlan:
        from studio.session.fork import open_fork
        from studio.session.plan import SessionPlan
        from studio.session.records.outputs import check_target

        check_target(out)
        if recording.resolve().parent == out.resolve():
            raise ValueError(f"{out}: holds the recording that is forked; choose another folder")
        with tempfile.TemporaryDirectory() as folder:
            scenario = document.scenario_name or None
            if document.scenario:
                file = Path(folder) / f"{scenario or 'scenario'}.toml"
                file.write_text(document.scenario, encoding="utf-8")
                scenario = str(file)
            fork = open_fork(recording, at_s=at_s, scenario=scenario, more_faults=more_faults)
        info = fork.info
        assert info.seed is not None
        return SessionPlan(scene=info.scene, seed=info.seed, methods=info.methods, fork=fork)

    return Task("planning a fork", work)


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

    def work(report: Report, cancelled: threading.Event) -> TwoRuns:
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
            index = read_index(recording_file(folder), progress=report, cancelled=cancelled)
            if index is None:
                raise ValueError("comparing was cancelled")
            opened.append(open_recording(index, comparison.scene))
        return TwoRuns(comparison, (opened[0], opened[1]))

    return Task("comparing", work)


def writing_page(comparison: Comparison) -> Task[Path]:
    """Begin to write the comparison's page beside B's folder; the result is its path."""

    def work(_report: Report, _cancelled: threading.Event) -> Path:
        from studio.compare.page import write_comparison

        folder = comparison.b.folder
        path = folder.with_name(f"{folder.name}-compared.html").absolute()
        write_comparison(comparison, path)
        return path

    return Task("writing a page", work)
