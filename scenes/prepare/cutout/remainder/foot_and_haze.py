# pyright: standard
"""Splats that were found with an object and are the room's: the ground around its foot, and haze.

A mask takes the shadow beside a low object for the object, and in a trained room splats hang in the
air beside objects and paint what is behind.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from scenes.prepare.cutout.labelling.above_ground import SOLID
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

LEVEL_M = 0.015
"""Splats less far above the support may be the support's."""
FAR_M = 0.03
"""Haze farther than this from the object is none of it."""


def beside_foot(
    cloud: SplatCloud, labels: BoolArray, support_z_m: float, *, surface: FloatArray
) -> BoolArray:
    """(N,) the labelled splats in the support's level that are nearer to it than to the object.

    Args:
        cloud: the whole room, metres.
        labels: (N,) the object's splats.
        support_z_m: height of what the object stands on.
        surface: (K, 3) points on the object, as far as photos agree about them; what stands on its
            foot counts as well.
    """
    beside = np.zeros(len(cloud), dtype=bool)
    low = labels & (cloud.means[:, 2] < support_z_m + LEVEL_M)
    standing = labels & ~low & (cloud.opacities >= SOLID)
    if not low.any() or not standing.any():
        return beside
    at = cloud.means[low].astype(np.float64)
    own = np.concatenate([surface, cloud.means[standing].astype(np.float64)])
    beside[low] = np.abs(at[:, 2] - support_z_m) < KDTree(own).query(at)[0]
    return beside


def hanging_off(cloud: SplatCloud, which: BoolArray, points: FloatArray) -> BoolArray:
    """(N,) those of some splats that hang well away from the object; all if `points` is empty.

    Args:
        cloud: the whole room, metres.
        which: (N,) splats found with the object.
        points: (K, 3) on the object.
    """
    far = np.zeros(len(cloud), dtype=bool)
    if not len(points):
        return which
    if which.any():
        far[which] = KDTree(points).query(cloud.means[which].astype(np.float64))[0] > FAR_M
    return far
