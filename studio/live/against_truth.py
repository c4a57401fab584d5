"""A live session on a simulated camera against that camera's truth: the figures of the table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose, rotation_angle
from sim.wire.streaming.truth_file import TruthRow
from studio.console.rows import Row, at_least, at_most

FRAME_TO_POSE_BAR_MS = 130.0
"""Milliseconds from a picture's capture to its poses, 95th percentile: the product's promise."""

RECOVERY_BAR_S = 5.0
"""Seconds from a network's return to poses of new pictures: the product's promise."""

NOTICED_BAR_S, MOVED_BAR_CM = 2.0, 5.0
"""Of a bump: seconds until it is noticed, and how far objects at rest may appear to move."""

CALIBRATION_BARS = (0.3, 0.1, 5.0)
"""Of lenses and pose from live pictures: px, degrees, millimetres."""

LOCATED_M, LOCATED_RAD = 0.05, math.radians(1.0)
"""Error from which a camera counts as not found."""

MATCH_NS = 2_000_000_000
"""Longest from a picture's capture to its arrival, ns; beyond, its time stamp is another one's."""

BUMP_RAD = math.radians(0.1)
"""Turn of the true camera between two pictures that counts as a bump."""

SETTLED_S = 4.0
"""Seconds after a bump in which objects that rest must not appear to move."""

SEEN, PLAINLY_SEEN = 0.3, 0.5
"""Visible fractions from which an object's error counts, and from which it may not be wrong."""

WRONG_CM, WRONG_BAR_PERCENT = 5.0, 2.0
"""Error from which an object is not where it is said to be, as in the tables of `nexus evaluate`,
and how many may be."""

RING_ANGLES, RING_TURNS = 24, 48
"""Directions in which two lenses are compared: rings of equal area, and directions on each."""


@dataclass(frozen=True, slots=True, eq=False)
class Published:
    """Published results of one picture, wall times in ns since 1970.

    Attributes:
        pts_ns: the camera's own time of the picture.
        arrived_ns: its last byte.
        published_ns: its poses.
        world_from_object: by object id.
        world_from_rig: camera pose that was used.
        flagged: ids of objects whose pose may be wrong, as the tracker says.
    """

    pts_ns: int | None
    arrived_ns: int
    published_ns: int
    world_from_object: Mapping[str, Pose]
    world_from_rig: Pose | None
    flagged: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, eq=False)
class Matched:
    """A published picture and its truth."""

    published: Published
    truth: TruthRow


def matched(published: Sequence[Published], truth: Sequence[TruthRow]) -> list[Matched]:
    """Every published picture with its truth, by the camera's time stamp in ms and its arrival."""
    by_stamp: dict[int, list[TruthRow]] = {}
    for row in truth:
        by_stamp.setdefault(row.time.stamp_ns // 1_000_000, []).append(row)
    found: list[Matched] = []
    for item in published:
        if item.pts_ns is None:
            continue
        stamp_ms = round(item.pts_ns / 1e6)
        near = [
            row for at in (stamp_ms, stamp_ms - 1, stamp_ms + 1) for row in by_stamp.get(at, ())
        ]
        near = [row for row in near if 0 <= item.arrived_ns - row.time.wall_ns < MATCH_NS]
        if near:
            found.append(Matched(item, near[0]))
    return found


def delay_rows(pairs: Sequence[Matched]) -> list[Row]:
    """From a picture's capture to its poses; the first picture, searched in peace, is left out."""
    delays_ms = [
        (pair.published.published_ns - pair.truth.time.wall_ns) / 1e6 for pair in pairs[1:]
    ]
    if not delays_ms:
        return [at_most("live.frame_to_pose_ms.p95", math.nan, "ms", bar=FRAME_TO_POSE_BAR_MS)]
    p50, p95 = np.percentile(delays_ms, [50, 95])
    return [
        Row("live.frame_to_pose_ms.p50", float(p50), "ms"),
        at_most("live.frame_to_pose_ms.p95", float(p95), "ms", bar=FRAME_TO_POSE_BAR_MS),
    ]


def recovery_row(published: Sequence[Published], cut_ended_ns: Sequence[int]) -> Row:
    """Longest from a network's return (wall ns) to poses of a picture that arrived after it.

    Returns before the first of these pictures are left out: a long session keeps its last ones.
    """
    waits: list[float] = []
    since_ns = published[0].arrived_ns if published else 0
    for ended_ns in (t for t in cut_ended_ns if t >= since_ns):
        back = [item.published_ns for item in published if item.arrived_ns > ended_ns]
        waits.append((min(back) - ended_ns) / 1e9 if back else math.inf)
    longest = max(waits, default=math.nan)
    return at_most("live.cut.recovery_s", longest, "s", bar=RECOVERY_BAR_S)


def bump_times(truth: Sequence[TruthRow]) -> list[int]:
    """Wall times in ns at which the true camera was turned."""
    times: list[int] = []
    for before, after in pairwise(truth):
        if before.world_from_rig is None or after.world_from_rig is None:
            continue
        step = before.world_from_rig.inverse() @ after.world_from_rig
        if rotation_angle(step.rotation) > BUMP_RAD:
            times.append(after.time.wall_ns)
    return times


def bump_rows(
    published: Sequence[Published], truth: Sequence[TruthRow], noticed_ns: Sequence[int]
) -> list[Row]:
    """How soon bumps were noticed, and how far objects that rest appeared to move.

    What was lost before a bump, and said to be, may be found at any time after it: it does not
    count.

    Args:
        published: of the session.
        truth: of the camera.
        noticed_ns: wall times at which the session said that the camera had moved.
    """
    first, last = published[0].published_ns, published[-1]
    # The last picture may have come before a bump and be published late after it.
    until = min(last.published_ns - SETTLED_S * 1e9, last.arrived_ns)
    bumps = [t for t in bump_times(truth) if first < t < until]
    waits: list[float] = []
    moved_cm: list[float] = []
    for bump_ns in bumps:
        # What happens while nothing arrives can be seen from the next picture on.
        seen_ns = min(item.arrived_ns for item in published if item.arrived_ns > bump_ns)
        after = [t for t in noticed_ns if t >= seen_ns]
        waits.append((min(after) - seen_ns) / 1e9 if after else math.inf)
        moved_cm.append(_moved_cm(published, truth, bump_ns))
    noticed_s, moved = max(waits, default=math.nan), max(moved_cm, default=math.nan)
    return [
        at_most("live.bump.noticed_s", noticed_s, "s", bar=NOTICED_BAR_S),
        at_most("live.bump.moved_cm.max", moved, "cm", bar=MOVED_BAR_CM),
    ]


def _moved_cm(published: Sequence[Published], truth: Sequence[TruthRow], bump_ns: int) -> float:
    """Largest distance of an object at rest from where it was published before a bump, cm.

    Of objects that were published as sure before it, right or wrong.
    """
    until_ns = bump_ns + round(SETTLED_S * 1e9)
    before = [item for item in published if item.arrived_ns <= bump_ns]
    since_ns = before[-1].arrived_ns - 1e9 if before else bump_ns
    rows = [row for row in truth if since_ns <= row.time.wall_ns <= until_ns]
    after = [item for item in published if bump_ns < item.arrived_ns <= until_ns]
    if not before or not rows:
        return 0.0
    largest = 0.0
    for name, pose in before[-1].world_from_object.items():
        true = np.array(
            [r.world_from_object[name].translation for r in rows if name in r.world_from_object]
        )
        if not len(true) or float(np.ptp(true, axis=0).max()) > 1e-3:
            continue
        if name in before[-1].flagged:
            continue
        for item in after:
            apart = item.world_from_object[name].translation - pose.translation
            largest = max(largest, 100.0 * float(np.linalg.norm(apart)))
    return largest


def object_rows(pairs: Sequence[Matched]) -> list[Row]:
    """Median error of visible objects' places, and how many of those in plain sight are wrong."""
    errors_cm: list[float] = []
    is_wrong: list[bool] = []
    for pair in pairs:
        for name, pose in pair.published.world_from_object.items():
            true, seen = pair.truth.world_from_object.get(name), pair.truth.visible_fraction
            if true is None or seen.get(name, 0.0) <= SEEN:
                continue
            errors_cm.append(100.0 * float(np.linalg.norm(pose.translation - true.translation)))
            if seen[name] > PLAINLY_SEEN:
                is_wrong.append(errors_cm[-1] > WRONG_CM)
    if not errors_cm:
        return [Row("live.object_cm.p50", None, "cm")]
    wrong_percent = 100.0 * float(np.mean(is_wrong)) if is_wrong else 0.0
    return [
        Row("live.object_cm.p50", float(np.median(errors_cm)), "cm"),
        at_most("live.wrong_percent", wrong_percent, "%", bar=WRONG_BAR_PERCENT),
    ]


def calibration_rows(
    rig: Rig, world_from_rig: Pose, true_rig: Rig, world_from_true_rig: Pose
) -> list[Row]:
    """Lenses and pose against the true ones; both rigs have the same picture size."""
    px_bar, deg_bar, mm_bar = CALIBRATION_BARS
    pixels = max(lens_apart_px(a, b) for a, b in zip(rig.lenses, true_rig.lenses, strict=True))
    step = world_from_true_rig.inverse() @ world_from_rig
    return [
        at_most("live.calibration.px", pixels, "px", bar=px_bar),
        at_most(
            "live.calibration.deg", math.degrees(rotation_angle(step.rotation)), "deg", bar=deg_bar
        ),
        at_most(
            "live.calibration.mm", 1000 * float(np.linalg.norm(step.translation)), "mm", bar=mm_bar
        ),
    ]


def lens_apart_px(lens: Fisheye, true: Fisheye) -> float:
    """Root mean square distance of the pixels of equal directions, over the lens circle."""
    reach = min(lens.max_angle, true.max_angle)
    angles = reach * np.sqrt((np.arange(RING_ANGLES) + 0.5) / RING_ANGLES)
    turns = 2 * np.pi * (np.arange(RING_TURNS) + 0.5) / RING_TURNS
    angle, turn = (grid.ravel() for grid in np.meshgrid(angles, turns, indexing="ij"))
    around: NDArray[np.float64] = np.column_stack([np.cos(turn), np.sin(turn)])
    rays = np.column_stack([around * np.sin(angle)[:, None], np.cos(angle)])
    apart = lens.project(rays)[0] - true.project(rays)[0]
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))


def located_row(found: Sequence[tuple[Pose, Pose]]) -> Row:
    """Share of searches for the camera that were right.

    Args:
        found: pairs of found and true `world_from_rig`.
    """
    right = 0
    for pose, true in found:
        step = true.inverse() @ pose
        near = float(np.linalg.norm(step.translation)) <= LOCATED_M
        right += near and rotation_angle(step.rotation) <= LOCATED_RAD
    percent = 100.0 * right / len(found) if found else math.nan
    return at_least("live.located_percent", percent, "%", bar=95.0)
