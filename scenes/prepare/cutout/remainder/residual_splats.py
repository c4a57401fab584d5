# pyright: standard
"""Residual splats of an object on its support: dark edges, and the shadow at its foot.

Nobody saw the support there. Splats at an object's lower edge lie on both sides of it, and shadow
goes with the object that casts it. What lies under or right beside the foot in a colour that the
support has nowhere around is a residue of the object.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from scenes.prepare.cutout.colour_similarity import usual
from scenes.prepare.cutout.labelling.above_ground import SOLID
from scenes.prepare.cutout.level_planes import level_area
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

FOOT_M = 0.05
"""Up to so high above its support an object's splats are its foot."""
BELOW_M = 0.02
"""And so far below it."""
BESIDE_M = 0.04
"""Traces lie at most so far beside the foot."""
DEPTHS_M = (-0.05, 0.04)
"""And between so far below the support and so far above it."""
SHADOW_M = 0.09
"""So far from the foot the support looks as it does without the object."""
AROUND_M = 0.3
"""How far around the object its support's colours are looked at."""
SURFACE_M = 0.03
"""How far the support's splats lie from it."""
CELL_M = 0.005
MIN_SPLATS_AROUND = 40
"""Splats of the support from which on its look is known."""


def residual_splats(cloud: SplatCloud, labels: BoolArray, support_z_m: float) -> BoolArray:
    """(N,) the splats of the room that an object has left under and beside its foot.

    Args:
        cloud: the whole room, metres, Z up.
        labels: (N,) the object's splats, and those that go with it.
        support_z_m: height of what the object stands on.
    """
    found = np.zeros(len(cloud), dtype=bool)
    means = cloud.means.astype(np.float64)
    height = means[:, 2] - support_z_m
    solid = cloud.opacities >= SOLID
    foot = labels & solid & (height > -BELOW_M) & (height < FOOT_M)
    if not foot.any():
        return found
    low, high = means[labels, :2].min(axis=0) - AROUND_M, means[labels, :2].max(axis=0) + AROUND_M
    near = np.flatnonzero(~labels & ((means[:, :2] > low) & (means[:, :2] < high)).all(axis=1))
    apart = _from_foot(means[near, :2], means[foot, :2])
    level = solid[near] & (np.abs(height[near]) < SURFACE_M)
    support = near[level & (apart > SHADOW_M)]
    under = near[(apart < BESIDE_M) & (height[near] > DEPTHS_M[0]) & (height[near] < DEPTHS_M[1])]
    if len(support) < MIN_SPLATS_AROUND or not len(under):
        return found
    colours = np.clip(cloud.colours(), 0.0, 1.0)
    area = level_area(cloud.select(support))
    found[under] = ~usual(colours[under], among=colours[support], area=area)
    return found


def _from_foot(places: FloatArray, foot: FloatArray) -> FloatArray:
    """(N,) how far places (N, 2) are from a foot's splats (K, 2) or from what these enclose."""
    low = np.minimum(foot.min(axis=0), places.min(axis=0)) - CELL_M
    high = np.maximum(foot.max(axis=0), places.max(axis=0)) + CELL_M
    free = np.ones(np.ceil((high - low) / CELL_M).astype(int), dtype=bool)
    rows, columns = ((foot - low) / CELL_M).astype(np.intp).T
    free[rows, columns] = False
    away = np.asarray(ndimage.distance_transform_edt(free), dtype=np.float64) * CELL_M
    enclosed = np.asarray(ndimage.binary_fill_holes(away < BESIDE_M), dtype=bool)
    away = np.where(enclosed, np.minimum(away, BESIDE_M - CELL_M), away)
    rows, columns = ((places - low) / CELL_M).astype(np.intp).T
    return away[rows, columns]
