"""Small objects: the pose at which one drawn into the empty room explains the live picture best.

At twenty pixels an outline is a contact shadow's as much as the object's own; the colours of the
object and of what is behind it tell them apart (dense likelihood, Nelder & Mead 1965).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, minimize

from scenes.pose import Pose
from tracking.evidence.surroundings import FINER, Place, Surroundings, Upright, pose_of, upright_of

Points = NDArray[np.float64]

STEP_M, STEP_RAD = 0.04, 0.2
STEP_PRICE = 4.0
"""First steps, and what a step away from the start costs, in pixels wholly unexplained."""

TRIED_ROUGHLY, TRIED_CLOSELY, TRIED_KNOWN = 24, 20, 18
"""How many poses are tried near a believed one to come near the best, and to tell it closely; the
last of an object whose place is known."""

CLOSE_STEP_M, CLOSE_STEP_RAD = 0.025, 0.15
LIT_ANEW = (1.0, 0.6)
RESOLVED = 0.001
"""First steps where a pose is told closely, the shares of them that are taken each time its light
was told, and differences of resemblance that end it."""

FIRST_STEPS, FAR_BEHIND, BEHIND = 5, 0.3, 0.2
"""What resembles the picture by so much less than another pose does, after so many steps, or by the
last once its light is to be told anew, does not catch up."""


def fit_patch(around: Surroundings, world_from_start: Pose) -> tuple[Pose, float]:
    """The pose near a start, on its height, at which the object explains the picture best.

    Returns:
        The pose, and how much the object at just this pose resembles the picture there, see
        `tracking.model.similarity.Setting.similarity`.
    """
    world_from_rough, _ = fit_patch_roughly(around, world_from_start)
    return fit_patch_closely(around, world_from_rough, tried=TRIED_KNOWN)


def fit_patch_roughly(around: Surroundings, world_from_start: Pose) -> tuple[Pose, float]:
    """The same with less effort and a pull to the start; `fit_patch_closely` goes on from there."""
    place = around.at(world_from_start)
    if place is None:
        return world_from_start, 0.0
    start = upright_of(world_from_start)
    lit = place.lit(start)

    def cost(steps: Points) -> float:
        robust_residual_px = place.residual_px(lit, _stepped(start, steps, STEP_M, STEP_RAD))
        return robust_residual_px + STEP_PRICE * float(steps @ steps)

    steps, _ = _least(cost, TRIED_ROUGHLY, resolved=0.1)
    found = _stepped(start, steps, STEP_M, STEP_RAD)
    return pose_of(found), place.close_similarity(place.lit(found, finer=FINER), found)


def fit_patch_closely(
    around: Surroundings,
    world_from_rough: Pose,
    *,
    tried: int = TRIED_CLOSELY,
    rival: float = 0.0,
) -> tuple[Pose, float]:
    """The same from a rough pose, which nothing but the picture speaks for: it has no pull.

    Args:
        around: the object's window.
        world_from_rough: where to begin.
        tried: how many poses are tried, each time the light was told.
        rival: how much another pose resembles the picture; what cannot come near that is not told
            any more closely.
    """
    place = around.at(world_from_rough)
    if place is None:
        return world_from_rough, 0.0
    found = upright_of(world_from_rough)
    for share in LIT_ANEW:
        # The light is told at the pose before, and is as wrong as that.
        found, similarity = _refined_in_light(place, found, share, tried, wanted=rival - FAR_BEHIND)
        if similarity < rival - BEHIND:
            return pose_of(found), similarity
    return pose_of(found), place.close_similarity(place.lit(found, finer=FINER), found)


def _refined_in_light(
    place: Place, start: Upright, share: float, tried: int, *, wanted: float
) -> tuple[Upright, float]:
    """The pose near a start that resembles the picture most in the light told at the start.

    And how much it does so; the search ends early where that is not wanted.
    """
    lit = place.lit(start, finer=FINER)
    step_m, step_rad = share * CLOSE_STEP_M, share * CLOSE_STEP_RAD

    def cost(steps: Points) -> float:
        return -place.close_similarity(lit, _stepped(start, steps, step_m, step_rad))

    steps, lowest = _least(cost, tried, resolved=RESOLVED, hopeless=-wanted)
    return _stepped(start, steps, step_m, step_rad), -lowest


def _least(
    cost: Callable[[Points], float],
    evaluations: int,
    *,
    resolved: float,
    hopeless: float = math.inf,
) -> tuple[Points, float]:
    """(3,) steps of x, y and yaw at which a cost is lowest, of so many tried; the cost there.

    It ends after `FIRST_STEPS` where the cost is higher than is hopeless.
    """
    steps = 0

    def give_up(intermediate_result: OptimizeResult) -> None:
        nonlocal steps
        steps += 1
        if steps == FIRST_STEPS and intermediate_result.fun > hopeless:
            raise StopIteration

    simplex = np.vstack([np.zeros(3), np.eye(3)])
    options = {"maxfev": evaluations, "initial_simplex": simplex, "xatol": 0.02, "fatol": resolved}
    found = minimize(cost, np.zeros(3), method="Nelder-Mead", options=options, callback=give_up)
    return np.asarray(found.x, dtype=np.float64), float(found.fun)


def _stepped(start: Upright, steps: Points, step_m: float, step_rad: float) -> Upright:
    """The pose so many steps of x, y and yaw from a start."""
    across, along, turns = steps.tolist()
    x, y, z, yaw = start
    return x + step_m * across, y + step_m * along, z, yaw + step_rad * turns


def similarity_at(around: Surroundings, world_from_object: Pose) -> float:
    """How much an object at a rough pose looks like the picture, at most 1, 0 for by chance.

    See `tracking.model.similarity.Setting.similarity`.
    """
    place = around.at(world_from_object)
    return 0.0 if place is None else place.similarity(upright_of(world_from_object))


def detail_similarities(around: Surroundings, poses: Sequence[Pose]) -> list[float] | None:
    """How much an object at each of some poses at one place looks like the picture by its detail.

    See `tracking.evidence.surroundings.Place.detail_similarities`; None if nothing of it is in the
    window, too.
    """
    place = around.at(poses[0])
    return (
        None if place is None else place.detail_similarities([upright_of(pose) for pose in poses])
    )
