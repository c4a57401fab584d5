"""Splats above the ground around an object, and those of them connected with the object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cutout.level_planes import LevelPlane, level_planes, on_planes
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

RING_M = 0.3
"""How far around an object its support is looked for."""
AROUND_M = 0.1
"""How far beyond an object splats are looked at, to see what goes on there."""
TRAINED_PLANE_M = 0.02
"""Half the thickness of a trained floor."""
SOLID = 0.3
"""Opacity from which on a splat of a trained room holds others together."""
FREE_SHARE = 0.9
"""Of a body: what must lie inside all boxes for it to be free-standing."""


def planes_around(cloud: SplatCloud, inner: FloatArray) -> tuple[LevelPlane, ...]:
    """Level planes of what surrounds the splats that lie in all boxes."""
    low, high = inner.min(axis=0), inner.max(axis=0)
    means = cloud.means
    ring = ((means > low - RING_M) & (means < high + RING_M)).all(axis=1)
    ring &= ~((means > low) & (means < high)).all(axis=1)
    return level_planes(cloud.select(ring))


def standing(cloud: SplatCloud, within: BoolArray) -> BoolArray:
    """(N,) the splats above the lowest level plane around, and in none of the others."""
    positions = cloud.means.astype(np.float64)
    planes = planes_around(cloud, positions[within])
    raised = tuple(replace(p, reach_m=max(p.reach_m, TRAINED_PLANE_M)) for p in planes)
    lowest = min((p.height_m for p in raised), default=-np.inf)
    return within & ~on_planes(positions, raised) & (positions[:, 2] > lowest)


def above_and_ground(
    cloud: SplatCloud, within: BoolArray, in_boxes: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """(N,) what stands above all planes around some splats, and (N,) the ground outside the boxes.

    Args:
        cloud: the whole room, metres.
        within: (N,) the splats around which it is looked at.
        in_boxes: (N,) what lies in all boxes that were drawn around an object.
    """
    positions = cloud.means.astype(np.float64)
    inner = positions[within]
    low, high = inner.min(axis=0) - AROUND_M, inner.max(axis=0) + AROUND_M
    around = ((positions > low) & (positions < high)).all(axis=1)
    above = standing(cloud, around)
    return above, around & ~above & ~in_boxes
