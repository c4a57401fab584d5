"""Proposals on labelled pictures: is what people moved found around where it was known?"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.evaluate.answers import MIN_VISIBLE, MIN_WIDTH_PX
from benchmarks.tracking.windows import LabelledPicture, LabelledRoom
from studio.console.rows import Row, at_most
from tracking.follow.rebirth import FARTHEST_M, FASTEST_M_S, JUMP_M, lifted_heights
from tracking.hypotheses.births import Expected, born
from tracking.solve.motion import Motion, pose_vector, vector_pose

GAPS = (1, 3, 6)
"""Pictures since an object was known: the next one, and after it was hidden for so many."""

FOUND_CM, FOUND_DEG = 5.0, 10.0
"""Errors up to which the next step's solve follows."""

MS_BAR = 5.0
"""Milliseconds that a look in the next picture may take."""


@dataclass(frozen=True, slots=True)
class Proposed:
    """One object in one picture.

    Attributes:
        gap: pictures since it was known.
        is_first: whether the likeliest pose is the true one.
        is_among: whether any is.
        ms: duration of the look.
    """

    gap: int
    is_first: bool
    is_among: bool
    ms: float


def measure_proposals(room: LabelledRoom, *, stopwatch_ns: Callable[[], int]) -> list[Proposed]:
    """Look for everything that people move, from where it was some pictures before."""
    pictures: list[LabelledPicture] = []
    found: list[Proposed] = []
    for picture in room.sequence():
        pictures.append(picture)
        for name in picture.moving:
            if _is_asked(pictures, name):
                found += _looks(room, pictures, name=name, stopwatch_ns=stopwatch_ns)
        del pictures[: -max(GAPS) - 2]
    return found


def proposal_rows(found: Iterable[Proposed]) -> list[Row]:
    """Figures over all rooms."""
    found = list(found)
    rows: list[Row] = []
    for gap in GAPS:
        some = [item for item in found if item.gap == gap]
        shares = [100.0 * float(np.mean([item.is_first for item in some] or [0.0]))]
        name = "proposals.recall" if gap == min(GAPS) else f"proposals.recall_after_{gap}"
        rows.append(Row(name, shares[0], "%"))
    first = [item.ms for item in found if item.gap == min(GAPS)] or [0.0]
    later = [item.ms for item in found if item.gap == max(GAPS)] or [0.0]
    return [
        *rows,
        Row("proposals.of", float(sum(item.gap == min(GAPS) for item in found)), ""),
        at_most("proposals.ms", float(np.median(first)), "ms", bar=MS_BAR),
        Row("proposals.ms_later", float(np.median(later)), "ms"),
    ]


def _is_asked(pictures: Sequence[LabelledPicture], name: str) -> bool:
    now, begin = pictures[-1], pictures[0]
    seen = now.visible[name]
    is_shown = seen.fraction >= MIN_VISIBLE and seen.width_px >= MIN_WIDTH_PX
    moved = not np.allclose(now.poses[name].matrix(), begin.poses[name].matrix(), atol=1e-4)
    return is_shown and moved


def _looks(
    room: LabelledRoom,
    pictures: Sequence[LabelledPicture],
    *,
    name: str,
    stopwatch_ns: Callable[[], int],
) -> Iterator[Proposed]:
    now = pictures[-1]
    model = next(model for model in now.models if model.object_id == name)
    for gap in GAPS:
        if len(pictures) < gap + 2:
            continue
        before, known = pictures[-gap - 2], pictures[-gap - 1]
        expected = _expected(room, (before, known, now), name=name)
        began = stopwatch_ns()
        hypotheses = born(now.scene, model, neighbours=now.neighbours(name), expected=expected)
        ms = (stopwatch_ns() - began) / 1e6
        errors = [
            room.error_of(
                name, world_from_found=item.world_from_object, world_from_true=now.poses[name]
            )
            for item in hypotheses
        ]
        right = [error.world_cm <= FOUND_CM and error.yaw_deg <= FOUND_DEG for error in errors]
        yield Proposed(gap, bool(right) and right[0], any(right), ms)


def _expected(room: LabelledRoom, pictures: Sequence[LabelledPicture], *, name: str) -> Expected:
    """Poses and places of an object that was known in the first two of three pictures."""
    before, known, now = pictures
    pose = known.poses[name]
    motion = Motion.rest(before.t_ns).measured(before.poses[name], pose, known.t_ns)
    moved = vector_pose(pose_vector(motion.predict(pose, now.t_ns)))
    reach_m = min(JUMP_M + FASTEST_M_S * (now.t_ns - known.t_ns) * 1e-9, FARTHEST_M)
    height_m, lowest = float(pose.translation[2]), min(room.support_heights_m)
    supports = tuple(h for h in room.support_heights_m if abs(h - height_m) < reach_m)
    lifts = lifted_heights(height_m, reach_m=reach_m, lowest_m=lowest)
    return Expected((moved, pose), reach_m, supports, lifts)
