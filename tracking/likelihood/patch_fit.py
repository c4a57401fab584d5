# pyright: standard
"""Small objects: the pose at which one, composited over the empty room, fits the picture best.

At twenty pixels an outline is a contact shadow's as much as the object's own; the colours of the
object and of the background separate them (dense likelihood, Nelder & Mead 1965).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, minimize

from scenes.pose import Pose
from tracking.evidence.surroundings import FINER, Place, Surroundings, Upright, pose_of, upright_of

Points = NDArray[np.float64]

STEP_M, STEP_RAD = 0.04, 0.2
STEP_PRICE = 4.0
"""First steps, and what a step away from the start costs, in pixels wholly unexplained."""

TRIED_ROUGHLY = 24
"""Evaluations of the rough fit."""

TRIED_CLOSELY = 20
"""Evaluations of each round of the close fit."""

CLOSE_STEP_M = 0.025
"""First step in m of the close fit."""

CLOSE_STEP_RAD = 0.15
"""First step in rad of the close fit."""

LIT_ANEW = (1.0, 0.6)
"""Factor on the first steps in each round of the close fit; the light is fitted before each."""

RESOLVED = 0.001
"""Difference of similarity that ends a round."""


FIRST_STEPS = 5
"""Iterations after which a round may be abandoned."""

FAR_BEHIND = 0.3
"""Similarity below the best rival's from which it is abandoned then."""

BEHIND = 0.2
"""Similarity below the best rival's from which no further round is begun."""


def fit_patch_roughly(around: Surroundings, world_from_start: Pose) -> Pose:
    """The pose near a rough one at which an object's colours fit, pulled to the start."""
    place = around.at(world_from_start)
    if place is None:
        return world_from_start
    start = upright_of(world_from_start)
    lit = place.lit(start)

    def cost(steps: Points) -> float:
        robust_residual_px = place.residual_px(lit, _stepped(start, steps, STEP_M, STEP_RAD))
        return robust_residual_px + STEP_PRICE * float(steps @ steps)

    steps, _ = _least(cost, TRIED_ROUGHLY, resolved=0.1)
    return pose_of(_stepped(start, steps, STEP_M, STEP_RAD))


def fit_patch_closely(
    around: Surroundings,
    world_from_rough: Pose,
    *,
    tried: int = TRIED_CLOSELY,
    rival: float = 0.0,
) -> tuple[Pose, float]:
    """The same from a rough pose, without a pull to the start.

    Args:
        around: the object's window.
        world_from_rough: start pose.
        tried: evaluations per round.
        rival: similarity of another pose; a fit that falls far below it is abandoned.
    """
    place = around.at(world_from_rough)
    if place is None:
        return world_from_rough, 0.0
    found = upright_of(world_from_rough)
    for share in LIT_ANEW:
        # The light is fitted at the previous pose, with that pose's error.
        found, similarity = _refined_in_light(place, found, share, tried, wanted=rival - FAR_BEHIND)
        if similarity < rival - BEHIND:
            return pose_of(found), similarity
    return pose_of(found), place.close_similarity(place.lit(found, finer=FINER), found)


def _refined_in_light(
    place: Place, start: Upright, share: float, tried: int, *, wanted: float
) -> tuple[Upright, float]:
    """The most similar pose near a start, in the light fitted at the start, and its similarity.

    The search ends early where that falls below `wanted`.
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
