"""How far an object reaches, by the views that look across.

Where an object ends to the left and to the right a view shows to a pixel, however rough the depths
in it are; where it ends towards the view and away from it only depths show. Of a level top views
show two quantities more: its far rim, and its middle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cutout.votes.seen_from import SeenFrom

FloatArray = NDArray[np.float64]

MIN_VIEWS = 3
"""Views that have to agree."""
ACROSS = 0.7
"""Cosine between a direction and how a view looks, from which on it does not look across."""
MAX_SHARE_ACROSS = 2 / 3
"""Of the views that look across: those that do most are used."""
SLICE_M = 0.01
"""Thickness of a slice across, metres."""
MIN_SLICE_SHARE = 0.05
"""Of the points in the fullest slice across: a slice that holds fewer is of strays."""
RIM_M = 0.05
"""How far below a level top the points of its rim may lie."""
MIN_ABOVE_M = 0.3
"""A view from less far above a level top looks along it."""
MIN_SPREAD = 0.03
"""Of the views' directions, as the mean square of the sine between them: less gives no middle."""


def reach_across(
    views: Sequence[SeenFrom], axis: FloatArray, above_m: float
) -> tuple[float, float] | None:
    """Ends of an object along a level direction; None if too few views look across.

    Args:
        views: what they show of it.
        axis: (2,) of length 1.
        above_m: points below that height are not the object's.
    """
    ends_by_view: list[tuple[float, tuple[float, float]]] = []
    for view in views:
        points = view.above(above_m)
        if not len(points):
            continue
        sight = points.mean(axis=0) - view.eye
        along = abs(float(sight[:2] @ axis)) / float(np.linalg.norm(sight))
        if along < ACROSS:
            ends_by_view.append((along, _ends(points[:, :2] @ axis)))
    if len(ends_by_view) < MIN_VIEWS:
        return None
    # The more a view looks along, the more it sees ends by depths as well.
    ends_by_view.sort()
    used = max(MIN_VIEWS, round(MAX_SHARE_ACROSS * len(ends_by_view)))
    low, high = np.median([ends for _, ends in ends_by_view[:used]], axis=0)
    return float(low), float(high)


def widest_reach(
    views: Sequence[SeenFrom], axis: FloatArray, above_m: float
) -> tuple[float, float] | None:
    """How far an object reaches along a level direction at most: so far two views see it reach.

    They may look along it, where depths show no more than that it ends there or before. None if too
    few views show it.

    Args:
        views: what they show of it.
        axis: (2,) of length 1.
        above_m: points below that height are not the object's.
    """
    ends_by_view: list[tuple[float, float]] = []
    for view in views:
        points = view.above(above_m)
        if len(points):
            ends_by_view.append(_ends(points[:, :2] @ axis))
    if len(ends_by_view) < MIN_VIEWS:
        return None
    lows, highs = np.sort(ends_by_view, axis=0).T
    return float(lows[1]), float(highs[-2])


def far_ends(
    views: Sequence[SeenFrom], axis: FloatArray, level_m: float
) -> tuple[float | None, float | None]:
    """Ends of a level top along a direction, on the sides away from the views.

    The highest rays of an outline meet the top in its far rim, whatever their depths say. None
    where too few views look along the direction from the other side.

    Args:
        views: what they show of the object.
        axis: (2,) of length 1.
        level_m: height of the top.
    """
    lows: list[float] = []
    highs: list[float] = []
    for view in views:
        points = view.above(level_m - RIM_M)
        if not len(points) or view.eye[2] < level_m + MIN_ABOVE_M:
            continue
        sight = points.mean(axis=0) - view.eye
        along = float(sight[:2] @ axis) / float(np.linalg.norm(sight))
        if abs(along) >= ACROSS:
            met = view.met(points, level_m)
            low, high = _ends(met @ axis)
            # The outline is half a pixel beyond the last pixel's centre.
            above = view.eye[2] - level_m
            away = float(np.hypot(np.linalg.norm(met.mean(axis=0) - view.eye[:2]), above))
            beyond = 0.5 * view.pixel_rad * away**2 / above
            (highs if along > 0 else lows).append(high + beyond if along > 0 else low - beyond)
    low, high = (float(np.median(e)) if len(e) >= MIN_VIEWS else None for e in (lows, highs))
    return low, high


def middle_of_top(views: Sequence[SeenFrom], level_m: float) -> FloatArray | None:
    """(2,) where the lines of sight meet that halve what views see of a level top.

    They all go through the middle of a top that is symmetric about it. None if the views
    look from too few sides.

    Args:
        views: what they show of the object.
        level_m: height of the top.
    """
    normals: list[FloatArray] = []
    offsets: list[float] = []
    for view in views:
        points = view.above(level_m - RIM_M)
        if not len(points):
            continue
        rays = points[:, :2] - view.eye[:2]
        ahead = rays.mean(axis=0)
        away = float(np.linalg.norm(ahead))
        ahead /= away
        left = np.array([-ahead[1], ahead[0]])
        turn = 0.5 * sum(_ends(away * np.arctan2(rays @ left, rays @ ahead))) / away
        normals.append(np.cos(turn) * left - np.sin(turn) * ahead)
        offsets.append(float(normals[-1] @ view.eye[:2]))
    if len(normals) < MIN_VIEWS:
        return None
    across = np.array(normals)
    if np.linalg.eigvalsh(across.T @ across / len(across))[0] < MIN_SPREAD:
        return None
    return np.asarray(np.linalg.lstsq(across, np.array(offsets), rcond=None)[0], dtype=np.float64)


def _ends(places: FloatArray) -> tuple[float, float]:
    """The lowest and the highest of the places (K,) that are none of strays."""
    slices = np.floor(places / SLICE_M).astype(np.intp)
    slices -= slices.min()
    count = np.bincount(slices)
    kept = places[count[slices] >= MIN_SLICE_SHARE * count.max()]
    return float(kept.min()), float(kept.max())
