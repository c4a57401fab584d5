"""Splats above the ground around an object, and those of them connected with the object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cutout.colour_similarity import log_likelihood_ratio
from scenes.prepare.cutout.connected_bodies import bodies, bodies_of_splats
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
HAZE_M = 0.05
"""So high above where an object begins splats of the ground's colours are the ground's: a
trained room leaves them in the air a few centimetres above its floor."""
SOLID_REACH_M = 0.03
"""Solid splats farther apart belong to different bodies."""
CLEARLY = float(np.log(2.0))
"""Log likelihood ratio of colours from which on they are the object's and no longer either's: twice
as near to its colours as to the ground's."""
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


def unlike_ground(
    cloud: SplatCloud, asked: BoolArray, *, like: BoolArray, within: BoolArray, in_boxes: BoolArray
) -> BoolArray:
    """(N,) those of the splats asked about whose colours are an object's rather than the ground's.

    Args:
        cloud: the whole room, metres.
        asked: (N,) splats in question.
        like: (N,) a part of the object that stands above the ground.
        within: (N,) where the object may be.
        in_boxes: (N,) what lies in all boxes that were drawn.
    """
    _, ground = above_and_ground(cloud, within, in_boxes)
    near = np.flatnonzero(asked | like | ground)
    ratio = log_likelihood_ratio(cloud.colours()[near], like=like[near], unlike=ground[near])
    found = np.zeros_like(asked)
    found[near[ratio > CLEARLY]] = True
    return found & asked


def hanging_on(
    cloud: SplatCloud,
    found: BoolArray,
    within: BoolArray,
    *,
    in_boxes: BoolArray,
    weights: FloatArray,
) -> BoolArray:
    """(N,) the solid splats above all planes that hang together with a part of an object.

    A mask may have lost the legs. A body that goes on outside the boxes says nothing, though: there
    the masks have to decide. Nor do splats of the ground's colours, which hang in the air above it.

    Args:
        cloud: the whole room, metres.
        found: (N,) the part, which stands above all planes.
        within: (N,) where the rest of the object may be.
        in_boxes: (N,) what lies in all boxes that were drawn.
        weights: (N,) how much each splat is meant; of several bodies the one meant most is taken.
    """
    hanging = np.zeros(len(cloud), dtype=bool)
    above, ground = above_and_ground(cloud, within, in_boxes)
    near = np.flatnonzero(above | ground | found)
    ratio = log_likelihood_ratio(cloud.colours()[near], like=found[near], unlike=ground[near])
    # A label may have the colours of a floor beyond; what hangs in the air hangs low.
    heights = cloud.means[near, 2]
    is_own = (ratio >= 0) | (heights > heights[found[near]].min(initial=np.inf) + HAZE_M)
    solid = near[is_own & above[near] & (cloud.opacities[near] >= SOLID)]
    if not found[solid].any():
        return hanging
    part = cloud.select(solid)
    # The long ends of a few splats may bridge the air to what stands beside.
    for count, body in (
        bodies_of_splats(part, SOLID_REACH_M),
        bodies(part.means, SOLID_REACH_M),
    ):
        meant = np.bincount(body, weights=(weights * found)[solid], minlength=count)
        main = solid[body == np.argmax(meant)]
        if in_boxes[main].mean() >= FREE_SHARE:
            hanging[main] = True
            break
    return hanging & within
