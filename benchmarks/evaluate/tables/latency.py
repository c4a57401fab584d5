"""From a frame's time to its published poses, at the camera's own pace.

Thirty pictures a second arrive as H.264 on a clock; a thread decodes them, as in a live session.
The tracker takes the newest; those that come while it is busy are dropped and counted.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.takes import RECORDING, Take
from benchmarks.evaluate.filmed.trial import marker_pose
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, aligned, own_bar, row_name
from benchmarks.evaluate.protocols.stations import eased
from benchmarks.evaluate.protocols.ten_objects import scanned_poses, ten_objects
from devices.clock import Clock, WallClock
from devices.messages import EncodedFrame, Frame
from devices.recording import read_recording
from devices.recording_codec import FrameStamp, RecordedValue
from devices.replay import FrameAssembler
from scenes.pose import Pose
from studio.console.rows import Row, at_least, at_most
from studio.evaluate.figures import OTHER, OWN
from studio.session.pipeline import PacedExecutor
from studio.session.trackers.methods import make_method
from tracking.output import TrackingMethod

FPS = 30
FRAMES = 150
MOVING: Mapping[str, tuple[tuple[float, float], float]] = {
    "chair-1": ((-0.35, 0.3), 0.6),
    "chair-2": ((-0.2, -0.35), -0.5),
}
"""By object id: how far it goes from where it stood (m) and turns (rad), to and fro."""

PERIOD_S = 4.0
FPS_BAR, P95_BAR_MS = 25.0, 60.0


@dataclass(frozen=True, slots=True, eq=False)
class Paced:
    """How one paced run went.

    Attributes:
        latency_ms: of every published frame.
        dropped: pictures that were not tracked.
        seconds: from the first picture's time to the last publication.
        cpu_s: processor time of the whole program meanwhile, decoding included.
        stage_ms: median of each stage.
    """

    latency_ms: tuple[float, ...]
    dropped: int
    seconds: float
    cpu_s: float
    stage_ms: Mapping[str, float]


def evaluate(asked: Asked) -> Findings:
    """Two chairs move among eight objects that stand still."""
    room, scene = ten_objects()
    taken = shots(scanned_poses(room))
    runs: dict[str, list[Paced]] = {name: [] for name in asked.methods}
    with FilmSet(room, cache=asked.cache) as film_set:
        for seed in asked.seeds:
            asked.progress.begin(f"filming two of ten objects, seed {seed}")
            take = film_set.film(
                taken, asked.conditions, seed=seed, advance=asked.progress.advance, fps=FPS
            )
            asked.progress.finish()
            known = marker_pose(room.world_from_rig, asked.conditions, seed=seed)
            for name in asked.methods:
                asked.progress.begin(f"tracking at {FPS} a second, {name}, seed {seed}")
                # The perfect detector's masks belong to a simulation in step with its tracker; here
                # the paper's method finds objects by what differs from the empty room.
                method = make_method(name, scene, stopwatch=time.perf_counter_ns)
                runs[name].append(paced(method, take, known))
                asked.progress.finish()
    return _report(runs)


def shots(scanned: Mapping[str, Pose]) -> list[Shot]:
    """The pictures: `MOVING` go to and fro, everything else stands."""
    taken = []
    for index in range(FRAMES):
        t_s = index / FPS
        share = eased((t_s / (0.5 * PERIOD_S)) % 2.0)
        poses = dict(scanned)
        for name, (way, turn) in MOVING.items():
            start = scanned[name]
            place = start.translation + share * np.array([*way, 0.0])
            poses[name] = Pose.from_yaw(start.yaw() + share * turn, place)
        taken.append(Shot(round(index * 1e9 / FPS), standing(poses)))
    return taken


def paced(method: TrackingMethod[Any], take: Take, known_world_from_rig: Pose) -> Paced:
    """Play a take at its own pace.

    The first picture is tracked before the clock starts: finding the camera happens once a session.
    """
    values = tuple(read_recording(take.folder / RECORDING))
    frames = _Decoder(take, values, known_world_from_rig)
    state, _ = method.step(method.start(), frames.first(), 0)
    latency_ms: list[float] = []
    stages: dict[str, list[float]] = {}
    cpu_s = time.process_time()
    clock = WallClock()
    last_ns = 0

    def step(frame: Frame) -> None:
        nonlocal state, last_ns
        state, output = method.step(state, frame, clock.now_ns())
        last_ns = clock.now_ns()
        latency_ms.append((last_ns - frame.t_ns) / 1e6)
        for name, duration_ns in output.stage_ns.items():
            stages.setdefault(name, []).append(duration_ns / 1e6)

    dropped = PacedExecutor(clock).run(
        lambda: frames.rest(clock),
        entered=lambda _frame: None,
        step=step,
        cancelled=threading.Event(),
    )
    medians = {name: float(np.median(values)) for name, values in stages.items()}
    cpu_s = time.process_time() - cpu_s
    return Paced(tuple(latency_ms), dropped, last_ns / 1e9, cpu_s, medians)


class _Decoder:
    """Decodes a take's packets, each not before its time.

    Args:
        take: for its lenses.
        values: of its recording.
        known_world_from_rig: `world_from_rig` of all frames.
    """

    def __init__(
        self, take: Take, values: tuple[RecordedValue, ...], known_world_from_rig: Pose
    ) -> None:
        self._assembler = FrameAssembler(take.session())
        self._values = iter(values)
        self._known = known_world_from_rig

    def first(self) -> Frame:
        """The first frame, at once."""
        return next(self._decoded(_at_once))

    def rest(self, clock: Clock) -> Iterator[Frame]:
        """The other frames, from the packet's time on; the clock's zero is the first one's time."""
        return self._decoded(clock.sleep_until)

    def _decoded(self, wait_until: Callable[[int], None]) -> Iterator[Frame]:
        for value in self._values:
            if isinstance(value, EncodedFrame):
                wait_until(value.t_ns)
            if not isinstance(value, EncodedFrame | FrameStamp):
                continue
            frame = self._assembler.feed(value)
            if frame is not None:
                yield replace(frame, world_from_rig=self._known)


def _at_once(_t_ns: int) -> None:
    """Waits for nothing."""


def _report(runs: Mapping[str, list[Paced]]) -> Findings:
    findings = Findings()
    for method, seen in runs.items():
        latency = np.array([value for run in seen for value in run.latency_ms])
        fps = sum(len(run.latency_ms) for run in seen) / sum(run.seconds for run in seen)
        findings.rows.append(
            at_least(row_name(method, "track.fps"), fps, "fps", bar=own_bar(method, FPS_BAR))
        )
        for percent, bar in ((50, None), (95, P95_BAR_MS), (99, None)):
            value = float(np.percentile(latency, percent))
            name = row_name(method, f"track.latency_ms.p{percent}")
            findings.rows.append(at_most(name, value, "ms", bar=own_bar(method, bar)))
        dropped = sum(run.dropped for run in seen)
        findings.rows.append(Row(row_name(method, "track.dropped"), float(dropped), ""))
        findings.rows.append(Row(row_name(method, "track.published"), float(len(latency)), ""))
        cores = sum(run.cpu_s for run in seen) / sum(run.seconds for run in seen)
        findings.rows.append(Row(row_name(method, "track.cores_used"), cores, ""))
        lines = [["stage", "median ms"]]
        for stage in seen[0].stage_ms:
            value = float(np.median([run.stage_ms[stage] for run in seen]))
            lines.append([stage, f"{value:.1f}"])
            findings.rows.append(Row(row_name(method, f"track.stage.{stage}.ms"), value, "ms"))
        findings.text.append(f"latency: {TITLES[method]}\n{aligned(lines)}")
    findings.drawings.append(Drawing("latency", lambda figure: _draw(figure, runs)))
    return findings


def _draw(figure: Figure, runs: Mapping[str, list[Paced]]) -> None:
    axes = figure.add_subplot()
    for method, seen in runs.items():
        latency = np.sort(np.array([value for run in seen for value in run.latency_ms]))
        share = 100.0 * (np.arange(len(latency)) + 1) / len(latency)
        colour = OWN if method == "own" else OTHER
        axes.plot(latency, share, color=colour, label=TITLES[method])
    axes.axvline(P95_BAR_MS, color="0.5", lw=1, ls="--")
    axes.set_xscale("log")
    axes.set_xlabel("from the frame's time to its poses, ms")
    axes.set_ylabel("published frames, %")
    axes.legend()
