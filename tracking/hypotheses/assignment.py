# pyright: standard
"""Assignment of positions to objects, jointly for all that are searched for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.optimize import linear_sum_assignment

from scenes.pose import Pose
from tracking.hypotheses.hypothesis import Hypothesis, is_other
from tracking.model.object_model import TrackModel

SAME_SPOT = 0.35
"""Distance, in the sum of two radii, below which two objects would intersect. Chosen on the rooms
lab and desk."""


LEVEL_M = 0.05
"""Height difference in m up to which two objects stand on one support plane."""

CLOSEST = 0.9
"""Distance of such objects, in half the sum of their narrower sides, below which they would
intersect. Chosen on the rooms lab and desk."""


NOWHERE = 0.92
"""Cost of leaving an object lost; a pose costs 1 less its score."""


DISTANCE_PRICE = 0.02
"""Cost of the largest distance from the last pose: decides between identical twins."""

DISTANCE_M = 5.0
"""Distance in m from which that cost no longer grows."""


IMPOSSIBLE = 1e3


@dataclass(frozen=True, slots=True, eq=False)
class AssignmentCandidates:
    """An object with its pose hypotheses.

    Attributes:
        model: the object.
        last_world_from_object: its last accepted pose.
        hypotheses: the best first.
    """

    model: TrackModel
    last_world_from_object: Pose
    hypotheses: Sequence[Hypothesis]


@dataclass(frozen=True, slots=True, eq=False)
class Assignment:
    """The hypothesis assigned to an object.

    Attributes:
        hypothesis: the pose.
        place_is_clear: whether no other free position scores about as well.
        yaw_is_clear: whether no other yaw at this position scores about as well.
    """

    hypothesis: Hypothesis
    place_is_clear: bool
    yaw_is_clear: bool


def assign(searched: Sequence[AssignmentCandidates]) -> Mapping[str, Assignment]:
    """One hypothesis for every object that has any, each position once, of the best total score.

    Args:
        searched: the objects; their order matters only for exact ties.
    """
    spots = _spots(searched)
    count = len(searched)
    cost = np.full((count, len(spots) + count), IMPOSSIBLE)
    cost[:, len(spots) :] = NOWHERE
    best: dict[tuple[int, int], Hypothesis] = {}
    for row, item in enumerate(searched):
        for hypothesis in item.hypotheses:
            column = _spot_of(spots, item.model, hypothesis)
            if (row, column) not in best:
                best[row, column] = hypothesis
                cost[row, column] = _cost(item, hypothesis)
    rows, columns = linear_sum_assignment(cost)
    chosen = {
        int(row): int(column)
        for row, column in zip(rows, columns, strict=True)
        if cost[row, column] < NOWHERE
    }
    taken = set(chosen.values())
    found: dict[str, Assignment] = {}
    for row, column in chosen.items():
        item, hypothesis = searched[row], best[row, column]
        here, elsewhere = True, True
        for other in item.hypotheses:
            spot = _spot_of(spots, item.model, other)
            if hypothesis.is_clearly_better(other):
                continue
            if spot == column:
                same = not is_other(
                    item.model, other.world_from_object, hypothesis.world_from_object
                )
                here = here and same
            elif spot not in taken:
                elsewhere = False
        found[item.model.object_id] = Assignment(hypothesis, elsewhere, here)
    return MappingProxyType(found)


def is_same_spot(
    model: TrackModel, world_from_object: Pose, other: TrackModel, world_from_other: Pose
) -> bool:
    """Whether two objects at two poses would stand in each other."""
    apart = world_from_object.translation - world_from_other.translation
    if float(np.linalg.norm(apart)) < SAME_SPOT * (model.radius_m + other.radius_m):
        return True
    is_beside = abs(float(apart[2])) < LEVEL_M
    narrowest = 0.5 * sum(min(item.source.box_m[:2]) for item in (model, other))
    return is_beside and float(np.hypot(*apart[:2])) < CLOSEST * narrowest


Spot = tuple[TrackModel, Pose]
"""The first object found at a place, and its pose."""


def _spots(searched: Sequence[AssignmentCandidates]) -> list[Spot]:
    """All places that somebody may stand at, the best supported first."""
    ranked = sorted(
        ((item, hypothesis) for item in searched for hypothesis in item.hypotheses),
        key=lambda pair: -pair[1].score,
    )
    spots: list[Spot] = []
    for item, hypothesis in ranked:
        if not any(_is_at(spot, item.model, hypothesis) for spot in spots):
            spots.append((item.model, hypothesis.world_from_object))
    return spots


def _spot_of(spots: Sequence[Spot], model: TrackModel, hypothesis: Hypothesis) -> int:
    return next(index for index, spot in enumerate(spots) if _is_at(spot, model, hypothesis))


def _is_at(spot: Spot, model: TrackModel, hypothesis: Hypothesis) -> bool:
    return is_same_spot(model, hypothesis.world_from_object, *spot)


def _cost(item: AssignmentCandidates, hypothesis: Hypothesis) -> float:
    apart = hypothesis.world_from_object.translation - item.last_world_from_object.translation
    away = min(float(np.linalg.norm(apart)), DISTANCE_M) / DISTANCE_M
    return 1.0 - hypothesis.score + DISTANCE_PRICE * away
