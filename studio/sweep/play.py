"""One run of a sweep in this process: a rehearsal without film or recording, and its figures."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from devices.recording_codec import RecordedTruth
from scenes.pose import Pose
from scenes.state import TrackState
from studio.evaluate.perfect_detector import PerfectDetector
from studio.evaluate.samples import Sample
from studio.evaluate.scores import ScoreBoard
from studio.session.opening import open_session
from studio.session.plan import SessionPlan
from studio.session.session import Session, SessionOutput
from studio.sweep.plan import Run

Row = dict[str, Any]
"""One tracker in one run; numbers are plain, None where nothing could be measured."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """State of one frame for a viewer.

    Attributes:
        seq: frame counter.
        received_ns: when it reached the session.
        tracked: `world_from_object` as tracked in it, by object id.
    """

    seq: int
    received_ns: int
    tracked: Mapping[str, Pose]


def play(run: Run) -> dict[str, Any]:
    """Rehearse; "rows" has one entry a tracker, "seconds" is how long it took.

    Raises:
        ValueError, OSError: the scene cannot be opened or the scenario doesn't fit it.
    """
    started = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="nexus-sweep-") as folder:
        scenario = Path(folder) / f"{run.name}.toml"
        scenario.write_text(run.scenario, encoding="utf-8")
        plan = SessionPlan(run.scene, str(scenario), run.seed, methods=run.methods)
        rows = _rows(run, open_session(plan, truth_detector=PerfectDetector()))
    return {"rows": rows, "seconds": time.monotonic() - started}


def _rows(run: Run, session: Session) -> list[Row]:
    boards = {name: ScoreBoard(session.scene.objects) for name in run.methods}
    arrivals: dict[str, list[Arrival]] = {name: [] for name in run.methods}
    truths: list[RecordedTruth] = []

    def watch(output: SessionOutput) -> None:
        truth = output.message.truth
        if truth is None:
            return
        truths.append(truth.recorded)
        frame = output.input.frame
        for name, answer in output.tracks.items():
            boards[name].add(answer.objects, truth.recorded)
            poses = {track.object_id: track.world_from_object for track in answer.objects}
            arrivals[name].append(Arrival(frame.seq, frame.received_ns, poses))

    result = session.run(watch)
    head: Row = {"fault": run.fault, "unit": run.unit, "size": run.size, "seed": run.seed}
    frames: Row = {"frames": result.frames, "frames_lost_on_the_way": result.lost}
    return [
        {**head, "method": name, **frames, **figures(boards[name], arrivals[name], truths)}
        for name in run.methods
    ]


def figures(board: ScoreBoard, arrivals: Iterable[Arrival], truths: Iterable[RecordedTruth]) -> Row:
    """The figures of one tracker over a run."""
    score = board.score()
    yaw = None if score is None else score.yaw_deg
    shown = np.array(shown_cm(arrivals, truths, {m.object_id for m in board.moved()}))
    return {
        "world_cm_mean": None if score is None else score.world_cm.mean,
        "world_cm_p95": None if score is None else score.world_cm.p95,
        "yaw_deg_mean": None if yaw is None else yaw.mean,
        "yaw_deg_p95": None if yaw is None else yaw.p95,
        "shown_cm_mean": float(shown.mean()) if len(shown) else None,
        "shown_cm_p95": float(np.percentile(shown, 95)) if len(shown) else None,
        "lost_share": lost_share(
            [s for m in board.moved() for s in board.samples(m.object_id) if s.counted]
        ),
    }


def lost_share(samples: list[Sample]) -> float | None:
    """Share of samples in which the tracker says that it has lost the object; None without any."""
    if not samples:
        return None
    return sum(s.state is TrackState.LOST for s in samples) / len(samples)


def shown_cm(
    arrivals: Iterable[Arrival], truths: Iterable[RecordedTruth], scored: set[str]
) -> list[float]:
    """How far what a viewer sees is from where the object is at that moment, centimetres.

    A viewer sees the newest frame that has arrived; the time that the tracker takes is left out.

    Args:
        arrivals: of one tracker.
        truths: of the frames that arrived; each is a moment at which is asked.
        scored: ids of objects that move; each counts from its first motion on.
    """
    waiting = sorted(arrivals, key=lambda arrival: arrival.received_ns)
    newest: Arrival | None = None
    moved: set[str] = set()
    errors: list[float] = []
    for truth in sorted(truths, key=lambda truth: truth.seq):
        now_ns = truth.t_ns if truth.captured_ns is None else truth.captured_ns
        while waiting and waiting[0].received_ns <= now_ns:
            arrived = waiting.pop(0)
            newest = arrived if newest is None or arrived.seq > newest.seq else newest
        moved |= truth.moved
        for object_id in sorted(moved & scored):
            if newest is not None and object_id in newest.tracked:
                apart = newest.tracked[object_id].translation
                apart = apart - truth.world_from_object[object_id].translation
                errors.append(100.0 * float(np.linalg.norm(apart)))
    return errors
