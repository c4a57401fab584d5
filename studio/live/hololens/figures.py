"""Figures of the local user's headset: delays of a real one, errors of a simulated one."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.hololens.values import StreamName
from scenes.pose import Pose
from studio.console.rows import Row, at_most
from studio.live.hololens.timing import Durations
from studio.live.hololens.worn import WornHeadset

VIDEO_BAR_MS, BODY_BAR_MS = 60.0, 10.0
"""From a picture, and from a measurement of head and hands, to whoever uses it, 95th percentile."""

CLOCK_BAR_MS = 1.0
"""Error of the headset's clock after ten seconds."""

ORIGIN_BAR_MM, ORIGIN_BAR_DEG = 5.0, 0.2
"""Error of the shared origin."""

MESH_BAR_MS = 200.0
"""From a surface's arrival to its collisions and occlusion, 95th percentile."""

POINT_BAR_MS, POINT_BAR_CM = 150.0, 2.0
"""From a remote person's pointing to the local user's seeing it, and how far beside the leg."""

TruePoses = Sequence[tuple[int, Mapping[str, Pose]]]
"""Wall times and poses of objects, in order of time."""

MAX_SEEN = 20_000
"""Places that are kept: of half an hour."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The end of a ray as it was truly seen on the headset.

    Attributes:
        wall_ns: when, since 1970.
        object_id: what was pointed at.
        at: (3,) in the room, metres.
        leg: (3,) the place on the object, in its frame.
    """

    wall_ns: int
    object_id: str
    at: NDArray[np.float64]
    leg: NDArray[np.float64]


@dataclass(slots=True)
class SimulatedFigures:
    """Errors and delays against the truth, gathered while the session runs."""

    clock_ms: Durations = field(default_factory=Durations)
    origin_mm: Durations = field(default_factory=Durations)
    origin_deg: Durations = field(default_factory=Durations)
    point_ms: Durations = field(default_factory=Durations)
    seen: deque[Seen] = field(default_factory=lambda: deque[Seen](maxlen=MAX_SEEN))
    items: int = 0


def worn_rows(worn: WornHeadset) -> list[Row]:
    """Return the figures that need no truth; what was not measured is left out."""
    status = worn.status()
    video = status.headset.streams.get(StreamName.VIDEO)
    rows = [
        *_p95("hololens.video_ms.p95", worn.video_delays, unit="ms", bar=VIDEO_BAR_MS),
        *_p95("hololens.hands_ms.p95", worn.body_delays, unit="ms", bar=BODY_BAR_MS),
        *_p95("hololens.mesh_update_ms.p95", worn.meshing.updates, unit="ms", bar=MESH_BAR_MS),
        Row("hololens.mesh_changes", float(status.mesh.changes), ""),
        Row("hololens.mesh_step_mm", status.mesh.largest_step_mm, "mm"),
        Row("hololens.display_items", float(status.drawn), ""),
    ]
    if video is not None:
        rows.append(Row("hololens.video_pictures", float(video.received), ""))
    if status.origin.sigma_mm is not None:
        rows.append(Row("hololens.origin_sigma_mm", status.origin.sigma_mm, "mm"))
        rows.append(Row("hololens.drift_mm", status.origin.drift_mm, "mm"))
    return rows


def simulated_rows(figures: SimulatedFigures, true_poses: TruePoses) -> list[Row]:
    """Return the figures against the truth; what was not measured is left out.

    Args:
        figures: gathered.
        true_poses: wall time and poses of objects, in order of time.
    """
    rows: list[Row] = []
    for name, kept, unit, bar in (
        ("hololens.clock_ms", figures.clock_ms, "ms", CLOCK_BAR_MS),
        ("hololens.origin_mm", figures.origin_mm, "mm", ORIGIN_BAR_MM),
        ("hololens.origin_deg", figures.origin_deg, "deg", ORIGIN_BAR_DEG),
    ):
        middle = kept.percentile(50.0)
        if middle is not None:
            rows.append(at_most(name, middle, unit, bar=bar))
            rows += _p95(f"{name}.p95", kept, unit=unit, bar=None)
    rows += _p95("session.point_ms.p95", figures.point_ms, unit="ms", bar=POINT_BAR_MS)
    off_cm = beside_cm(list(figures.seen), true_poses)
    if off_cm:
        middle_cm, worst_cm = np.percentile(off_cm, (50.0, 95.0)).tolist()
        rows.append(at_most("session.point_cm", middle_cm, "cm", bar=POINT_BAR_CM))
        rows.append(Row("session.point_cm.p95", worst_cm, "cm"))
    return rows


def beside_cm(seen: Sequence[Seen], true_poses: TruePoses) -> list[float]:
    """Return how far beside the true leg each ray was seen to end, centimetres."""
    times = [wall_ns for wall_ns, _ in true_poses]
    found: list[float] = []
    for each in seen:
        place = min(bisect_left(times, each.wall_ns), len(times) - 1)
        if place < 0 or each.object_id not in true_poses[place][1]:
            continue
        true = true_poses[place][1][each.object_id] @ each.leg
        found.append(100.0 * float(np.linalg.norm(true - each.at)))
    return found


def _p95(name: str, kept: Durations, *, unit: str, bar: float | None) -> list[Row]:
    value = kept.percentile(95.0)
    return [] if value is None else [at_most(name, value, unit, bar=bar)]
