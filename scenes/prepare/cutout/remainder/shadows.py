# pyright: standard
"""The shadow that an object cast on its support when the room was filmed: it goes with the object.

A shadow changes how light a place is, hardly its hue, and is smooth beside what is printed or grown
there. Beside the object the support shows how light each of its hues is without it.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from scenes.prepare.cutout.colour_similarity import usual
from scenes.prepare.cutout.level_planes import level_area
from scenes.splats import SH_C0, SplatCloud

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

SURFACE_M = 0.02
"""How far the support's splats lie from its plane."""
REACH_M, FADES_M = 0.45, 0.15
"""How far beside an object, seen from above, its shadow reaches; over so much of that it ends."""
BESIDE_M = 0.9
"""Up to so far away the support shows how light it is without the object."""
SAME_HUE = 0.03
"""Difference of the channels' shares up to which two places are of one hue."""
MAX_COMPARED = 2000
"""So many splats of the lit support are compared at most."""
MIN_SHARE_OF_HUE = 0.02
"""Share of the lit support that has to be of a hue to measure how light it is."""
SMOOTH_M = 0.05
"""Distance within which a shadow is uniform, metres."""
NOTICED = 0.95
"""Share of the lit support's light below which a splat is in the shadow."""
DARKEST = 0.4
"""No shadow is darker than this."""
DARKER = 0.5
"""Share below which a splat without the shadow is dark by itself."""
MIN_LIGHT = 1e-3
"""Light below which a ratio to it says nothing."""
THIN_M = 0.015
"""Standard deviation up to which splats lie flat: feet of objects that stand there do not."""
CELL_M = 0.01
"""Side of a cell of the support, metres."""


def without_shadow(
    room: SplatCloud, footprint: FloatArray, support_z_m: float
) -> tuple[BoolArray, SplatCloud]:
    """(N,) the room's splats in an object's shadow, and the same splats as they are without it.

    Args:
        room: without the object, metres, Z up.
        footprint: (K, 3) the object's splats.
        support_z_m: height of what it stands on.
    """
    gains = _gains(room, footprint, support_z_m)
    shaded = gains > 1.0
    found, more = room.select(shaded), gains[shaded][:, None].astype(np.float32)
    sh = found.sh * more[:, :, None]
    sh[:, 0] += (more - 1.0) * (0.5 / SH_C0)
    return shaded, replace(found, sh=sh)


def _gains(room: SplatCloud, footprint: FloatArray, support_z_m: float) -> FloatArray:
    """(N,) how much lighter the room's splats are without an object, 1 outside its shadow."""
    gains = np.ones(len(room))
    on_plane = np.abs(room.means[:, 2] - support_z_m) < SURFACE_M
    thin = room.select(on_plane).covariances()[:, 2, 2] < THIN_M**2
    level = np.flatnonzero(on_plane)[thin]
    away_m = _away(room.means[level, :2].astype(np.float64), footprint[:, :2])
    near, beside = level[away_m < REACH_M], level[(away_m >= REACH_M) & (away_m < BESIDE_M)]
    if len(near) == 0 or len(beside) == 0:
        return gains
    colours, areas = np.clip(room.colours().astype(np.float64), 0.0, 1.0), level_area(room)
    here, there = colours[near], colours[beside]
    share, is_known = _share(here, there, areas[beside])
    smooth = _smooth(share, areas[near], room.means[near, :2])
    fade = np.clip((REACH_M - away_m[away_m < REACH_M]) / FADES_M, 0.0, 1.0)
    gain = np.clip(smooth / NOTICED, DARKEST, 1.0) ** -fade
    # What would not look like the support in the light is something else that lies there.
    is_own = is_known & (gain * share > DARKER)
    is_own |= usual(gain[:, None] * here, among=there, area=areas[beside])
    gains[near] = np.where(is_own, gain, 1.0)
    return gains


def _away(places: FloatArray, footprint: FloatArray) -> FloatArray:
    """(N,) how far places are from an object's outline from above, 0 within it."""
    outline = cv2.convexHull(footprint.astype(np.float32))[:, 0, :]
    low = outline.min(axis=0) - BESIDE_M
    size = np.ceil((outline.max(axis=0) + BESIDE_M - low) / CELL_M).astype(int)
    free = np.ones(size[::-1], dtype=np.uint8)
    cv2.fillConvexPoly(free, np.round((outline - low) / CELL_M - 0.5).astype(np.int32), 0)
    away = CELL_M * cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    columns, rows = np.floor((places - low) / CELL_M).astype(np.intp).T
    inside = (rows >= 0) & (columns >= 0) & (rows < size[1]) & (columns < size[0])
    found = np.full(len(places), np.inf)
    found[inside] = away[rows[inside], columns[inside]]
    return found


def _share(
    colours: FloatArray, lit_colours: FloatArray, lit_areas: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """(N,) how light colours are beside what is of their hue in the light, and if that is known."""
    order = np.argsort(lit_areas)[::-1][:MAX_COMPARED]
    lit_colours, lit_areas = lit_colours[order], lit_areas[order]
    light, lit_light = colours.mean(axis=1), lit_colours.mean(axis=1)
    same = cdist(_hue(colours), _hue(lit_colours)) < SAME_HUE
    rank = np.argsort(lit_light)
    total = np.cumsum(same[:, rank] * lit_areas[rank], axis=1)
    middle = (total >= 0.5 * total[:, -1:]).argmax(axis=1)
    is_known = total[:, -1] > MIN_SHARE_OF_HUE * lit_areas.sum()
    share = light / np.maximum(lit_light[rank][middle], MIN_LIGHT)
    return np.where(is_known, share, 1.0), is_known


def _smooth(share: FloatArray, areas: FloatArray, places: NDArray[np.float32]) -> FloatArray:
    """(N,) the middle one of the shares around each place, weighed by area."""
    near = KDTree(places).query_ball_point(places, SMOOTH_M)
    return np.array([_middle(share[k], areas[k]) for k in near])


def _hue(colours: FloatArray) -> FloatArray:
    """(N, 3) the channels' shares."""
    return colours / np.maximum(colours.sum(axis=1, keepdims=True), MIN_LIGHT)


def _middle(values: FloatArray, weights: FloatArray) -> float:
    """The weighted median."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])
