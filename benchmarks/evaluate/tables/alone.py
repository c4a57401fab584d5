"""One object on one core: how long a frame takes, and how long to find it wherever it stands.

A session begins with the object elsewhere than the scan says: its pose is unknown. Then it is
pushed to and fro. All that is timed runs on the thread that asks, kept on one core; the empty room,
drawn by several threads when the camera is found, is no part of it. Times are the processor's.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.takes import Take
from benchmarks.evaluate.filmed.trial import marker_pose
from benchmarks.evaluate.findings import TITLES, Findings, aligned, own_bar, row_name
from benchmarks.evaluate.protocols.stations import eased
from benchmarks.evaluate.protocols.ten_objects import scanned_poses, ten_objects
from scenes.mesh import PhysicalRoom
from scenes.package import ScenePackage
from scenes.pose import Pose
from studio.console.rows import Row, at_most
from studio.evaluate.metrics import pose_error
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.session.trackers.methods import make_method
from tracking.output import TrackingMethod

FPS = 30
STANDS_FRAMES, MOVES_FRAMES = 15, 75
WAY_M, TURN_RAD, PERIOD_S = (0.25, 0.15), 0.5, 2.5


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """An object, and where it stands at the beginning: shifted (m) and turned (rad)."""

    object_id: str
    shift_m: tuple[float, float]
    turn_rad: float


STARTS = (
    Elsewhere("chair-1", (-0.5, -0.4), 1.4),
    Elsewhere("stool-1", (0.4, -0.6), 0.9),
    Elsewhere("book-1", (-0.16, 0.1), 1.0),
    Elsewhere("mug-1", (0.05, -0.22), 2.0),
)
STEP_BAR_MS, COLD_BAR_MS = 10.0, 300.0


@dataclass(frozen=True, slots=True, eq=False)
class Timed:
    """How long one object took.

    Attributes:
        cold_ms: to find it in the first frame, the camera's pose known.
        found_cm: how far off it was then.
        step_ms: (N,) of every frame in which it moved.
    """

    cold_ms: float
    found_cm: float
    step_ms: NDArray[np.float64]


def evaluate(asked: Asked) -> Findings:
    """Each object alone in the room."""
    room, scene = ten_objects()
    runs: dict[str, dict[str, list[Timed]]] = {
        name: {start.object_id: [] for start in STARTS} for name in asked.methods
    }
    for start in STARTS:
        alone = replace(room, objects=(room.object_by_id(start.object_id),))
        model = next(m for m in scene.objects if m.object_id == start.object_id)
        known = replace(scene, objects=(model,))
        with FilmSet(alone, cache=asked.cache) as film_set:
            for seed in asked.seeds:
                what = f"{start.object_id} alone, seed {seed}"
                asked.progress.begin(f"filming {what}")
                taken = shots(scanned_poses(alone), start)
                take = film_set.film(
                    taken, asked.conditions, seed=seed, advance=asked.progress.advance, fps=FPS
                )
                asked.progress.finish()
                marker = marker_pose(room.world_from_rig, asked.conditions, seed=seed)
                for name in asked.methods:
                    asked.progress.begin(f"tracking {what}, {name}")
                    runs[name][start.object_id].append(_timed(name, alone, known, take, marker))
                    asked.progress.finish()
    return _report(runs)


def shots(scanned: Mapping[str, Pose], start: Elsewhere) -> list[Shot]:
    """The object stands elsewhere for a while, then goes to and fro."""
    (pose,) = scanned.values()
    first = pose.translation + np.array([*start.shift_m, 0.0])
    taken = []
    for index in range(STANDS_FRAMES + MOVES_FRAMES):
        t_s = max(index - STANDS_FRAMES, 0) / FPS
        share = eased((t_s / (0.5 * PERIOD_S)) % 2.0)
        place = first + share * np.array([*WAY_M, 0.0])
        world_from_object = Pose.from_yaw(pose.yaw() + start.turn_rad + share * TURN_RAD, place)
        poses = standing({start.object_id: world_from_object})
        taken.append(Shot(round(index * 1e9 / FPS), poses))
    return taken


def _timed(
    name: str, room: PhysicalRoom, scene: ScenePackage, take: Take, marker_world_from_rig: Pose
) -> Timed:
    with one_core():
        method: TrackingMethod[Any] = make_method(name, scene, stopwatch=time.thread_time_ns)
        state = method.start()
        step_ms: list[float] = []
        cold_ms = found_cm = 0.0
        (item,) = room.objects
        for message in take.play(marker_world_from_rig, with_masks=False):
            began_ns = time.thread_time_ns()
            state, output = method.step(state, message.frame, 0)
            step_ms.append((time.thread_time_ns() - began_ns) / 1e6)
            if message.frame.seq == 0 and message.truth is not None:
                cold_ms = output.stage_ns.get("pose", 0) / 1e6
                (tracked,) = output.objects
                truth = message.truth.recorded.world_from_object[item.object_id]
                symmetry = SYMMETRY_OF_KIND.get(item.kind, 1)
                error = pose_error(tracked.world_from_object, truth, symmetry=symmetry)
                found_cm = error.world_cm
    return Timed(cold_ms, found_cm, np.array(step_ms[STANDS_FRAMES:]))


@contextmanager
def one_core() -> Iterator[None]:
    """Keeps this thread on one core, where the system can do that."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _report(runs: Mapping[str, Mapping[str, Sequence[Timed]]]) -> Findings:
    findings = Findings()
    for method, seen in runs.items():
        lines = [["object", "step ms", "p95", "cold start ms", "off by cm"]]
        slowest_ms = coldest_ms = 0.0
        for object_id, timed in seen.items():
            step_ms = np.concatenate([run.step_ms for run in timed])
            middle, late = np.percentile(step_ms, [50, 95])
            cold_ms = float(np.median([run.cold_ms for run in timed]))
            off_cm = float(np.median([run.found_cm for run in timed]))
            slowest_ms, coldest_ms = max(slowest_ms, float(middle)), max(coldest_ms, cold_ms)
            lines.append(
                [object_id, f"{middle:.1f}", f"{late:.1f}", f"{cold_ms:.0f}", f"{off_cm:.1f}"]
            )
            for figure, value, unit in (
                ("step_ms", float(middle), "ms"),
                ("cold_start_ms", cold_ms, "ms"),
                ("cold_start_cm", off_cm, "cm"),
            ):
                name = row_name(method, f"alone.{object_id}.{figure}")
                findings.rows.append(Row(name, value, unit))
        for figure, value, bar in (
            ("step_ms", slowest_ms, STEP_BAR_MS),
            ("cold_start_ms", coldest_ms, COLD_BAR_MS),
        ):
            name = row_name(method, f"alone.{figure}")
            findings.rows.append(at_most(name, value, "ms", bar=own_bar(method, bar)))
        findings.text.append(f"one object, one core: {TITLES[method]}\n{aligned(lines)}")
    return findings
