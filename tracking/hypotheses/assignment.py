# pyright: standard
"""Assignment of positions to objects, jointly for all that are searched for, by log odds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenes.pose import Pose
from tracking.hypotheses.hypothesis import Hypothesis, is_other
from tracking.model.object_model import TrackModel

SUNK_M = 0.05
"""Height in m by which one object may seem to sink into another that it stands on: what a cut's box
may be too high."""

CLOSEST = 0.9
"""Distance of two objects at one height, in half the sum of their narrower sides, below which they
would intersect; 1 less what a cut's box may be too large."""

IMPOSSIBLE = 1e6
"""Cost of what cannot be, nats: above any sum of log odds."""


@dataclass(frozen=True, slots=True, eq=False)
class AssignmentCandidates:
    """An object with its pose hypotheses.

    Attributes:
        model: the object.
        hypotheses: the likeliest first.
    """

    model: TrackModel
    hypotheses: Sequence[Hypothesis]


@dataclass(frozen=True, slots=True, eq=False)
class Assignment:
    """The hypothesis assigned to an object.

    Attributes:
        hypothesis: the pose.
        place_probability: posterior that the object is at this place, at any yaw.
        pose_probability: posterior that it is at this pose.
        rival_nats: log odds of this pose against the likeliest other yaw here; inf without one.
    """

    hypothesis: Hypothesis
    place_probability: float
    pose_probability: float
    rival_nats: float


def assign(searched: Sequence[AssignmentCandidates]) -> Mapping[str, Assignment]:
    """One hypothesis for every object that has a likely one, each position once.

    The sum of all log odds is the largest possible. What is less likely than being nowhere in view
    stays unassigned.

    Args:
        searched: the objects; their order matters only for exact ties.
    """
    spots = _spots(searched)
    count = len(searched)
    cost: NDArray[np.float64] = np.full((count, len(spots) + count), IMPOSSIBLE)
    cost[:, len(spots) :] = 0.0
    best: dict[tuple[int, int], Hypothesis] = {}
    for row, item in enumerate(searched):
        for hypothesis in item.hypotheses:
            column = _spot_of(spots, item.model, hypothesis)
            if (row, column) not in best:
                best[row, column] = hypothesis
                cost[row, column] = -hypothesis.log_odds
    rows, columns = linear_sum_assignment(cost)
    chosen = {
        int(row): int(column)
        for row, column in zip(rows, columns, strict=True)
        if cost[row, column] < 0.0
    }
    found: dict[str, Assignment] = {}
    for row, column in chosen.items():
        taken = {other for index, other in chosen.items() if index != row}
        free = [
            hypothesis
            for hypothesis in searched[row].hypotheses
            if _spot_of(spots, searched[row].model, hypothesis) not in taken
        ]
        found[searched[row].model.object_id] = _assignment(
            searched[row].model, best[row, column], free
        )
    return MappingProxyType(found)


def _assignment(model: TrackModel, chosen: Hypothesis, free: Sequence[Hypothesis]) -> Assignment:
    """The posterior of a hypothesis among all that are free, and being nowhere in view."""
    highest = max(0.0, *(hypothesis.log_odds for hypothesis in free))
    weights = [math.exp(hypothesis.log_odds - highest) for hypothesis in free]
    total = sum(weights) + math.exp(-highest)
    place = pose = 0.0
    rival_nats = math.inf
    for hypothesis, weight in zip(free, weights, strict=True):
        world_from_other = hypothesis.world_from_object
        if not is_same_spot(model, world_from_other, model, chosen.world_from_object):
            continue
        place += weight
        if is_other(model, world_from_other, chosen.world_from_object):
            rival_nats = min(rival_nats, chosen.log_odds - hypothesis.log_odds)
        else:
            pose += weight
    return Assignment(chosen, place / total, pose / total, rival_nats)


def is_same_spot(
    model: TrackModel, world_from_object: Pose, other: TrackModel, world_from_other: Pose
) -> bool:
    """Whether two objects at two poses would stand in each other."""
    apart = world_from_object.translation - world_from_other.translation
    (*sides, height_m), (*other_sides, other_height_m) = model.source.box_m, other.source.box_m
    # Flat objects sink in by half their height at most.
    sunk_m = min(SUNK_M, 0.5 * height_m, 0.5 * other_height_m)
    is_level = -height_m + sunk_m < float(apart[2]) < other_height_m - sunk_m
    narrowest = 0.5 * (min(sides) + min(other_sides))
    return is_level and float(np.hypot(*apart[:2])) < CLOSEST * narrowest


Spot = tuple[TrackModel, Pose]
"""The first object found at a place, and its pose."""


def _spots(searched: Sequence[AssignmentCandidates]) -> list[Spot]:
    """All places that somebody may stand at, the best supported first."""
    ranked = sorted(
        ((item, hypothesis) for item in searched for hypothesis in item.hypotheses),
        key=lambda pair: -pair[1].log_odds,
    )
    spots: list[Spot] = []
    for item, hypothesis in ranked:
        if not any(_is_at(spot, item.model, hypothesis) for spot in spots):
            spots.append((item.model, hypothesis.world_from_object))
    return spots


def _spot_of(spots: Sequence[Spot], model: TrackModel, hypothesis: Hypothesis) -> int:
    """Index of the first of some spots that a hypothesis is at."""
    return next(index for index, spot in enumerate(spots) if _is_at(spot, model, hypothesis))


def _is_at(spot: Spot, model: TrackModel, hypothesis: Hypothesis) -> bool:
    other, world_from_other = spot
    return is_same_spot(model, hypothesis.world_from_object, other, world_from_other)
