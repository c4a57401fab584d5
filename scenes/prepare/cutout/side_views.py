"""How far a thing reaches, by the views that look across.

Where a thing ends to the left and to the right a view tells to a pixel, however rough the depths in
it are; where it ends towards the view and away from it only depths tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEAST_VIEWS = 3
ACROSS = 0.7
"""Cosine between a direction and how a view looks, from which on it does not look across."""
MOST_ACROSS = 2 / 3
"""Of the views that look across: those that do most are heard."""
SLICE_M = 0.01
LEAST_SLICE = 0.05
"""Of the points in the fullest slice across: a slice that holds fewer is of strays."""
LEAST_POINTS = 60
RIM_M = 0.05
"""How far below a level top the points of its rim may lie."""
LEAST_ABOVE_M = 0.3
"""A view from less far above a level top looks along it."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenFrom:
    """What one view shows of a thing, up to its outline: world points (K, 3), seen from `eye`."""

    eye: FloatArray
    points: FloatArray


def reach_across(
    views: Sequence[SeenFrom], axis: FloatArray, above_m: float
) -> tuple[float, float] | None:
    """Where a thing begins and ends along a level direction; None if too few views look across.

    Args:
        views: what they show of it.
        axis: (2,) of length 1.
        above_m: points below that height are not the thing's.
    """
    told: list[tuple[float, tuple[float, float]]] = []
    for view in views:
        points = view.points[view.points[:, 2] > above_m]
        if len(points) < LEAST_POINTS:
            continue
        sight = points.mean(axis=0) - view.eye
        along = abs(float(sight[:2] @ axis)) / float(np.linalg.norm(sight))
        if along < ACROSS:
            told.append((along, _ends(points[:, :2] @ axis)))
    if len(told) < LEAST_VIEWS:
        return None
    # The more a view looks along, the more it sees ends by depths as well.
    told.sort()
    heard = max(LEAST_VIEWS, round(MOST_ACROSS * len(told)))
    low, high = np.median([ends for _, ends in told[:heard]], axis=0)
    return float(low), float(high)


def far_ends(
    views: Sequence[SeenFrom], axis: FloatArray, level_m: float
) -> tuple[float | None, float | None]:
    """Where a level top begins and ends along a direction, on the sides away from the views.

    The highest rays of an outline meet the top in its far rim, whatever their depths say. None
    where too few views look along the direction from the other side.

    Args:
        views: what they show of the thing.
        axis: (2,) of length 1.
        level_m: height of the top.
    """
    lows: list[float] = []
    highs: list[float] = []
    for view in views:
        points = view.points[view.points[:, 2] > level_m - RIM_M]
        if len(points) < LEAST_POINTS or view.eye[2] < level_m + LEAST_ABOVE_M:
            continue
        rays = points - view.eye
        sight = rays.mean(axis=0)
        along = float(sight[:2] @ axis) / float(np.linalg.norm(sight))
        if abs(along) >= ACROSS:
            met = view.eye + rays * ((level_m - view.eye[2]) / rays[:, 2:])
            low, high = _ends(met[:, :2] @ axis)
            (highs if along > 0 else lows).append(high if along > 0 else low)
    low, high = (float(np.median(e)) if len(e) >= LEAST_VIEWS else None for e in (lows, highs))
    return low, high


def _ends(places: FloatArray) -> tuple[float, float]:
    """The lowest and the highest of the places (K,) that are none of strays."""
    slices = np.floor(places / SLICE_M).astype(np.intp)
    slices -= slices.min()
    count = np.bincount(slices)
    kept = places[count[slices] >= LEAST_SLICE * count.max()]
    return float(kept.min()), float(kept.max())
