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
FOOT_M = 0.01
"""A foot reaches at most so far beyond what stands on it."""
FAR_M = 0.03
"""Haze farther than this from the object is none of it."""


def beside_foot(cloud: SplatCloud, labels: BoolArray, support_z_m: float) -> BoolArray:
    """(N,) the labelled splats in the support's level that nothing of the object stands on.

    Args:
        cloud: the whole room, metres.
        labels: (N,) the object's splats.
        support_z_m: height of what the object stands on.
    """
    low = labels & (cloud.means[:, 2] < support_z_m + LEVEL_M)
    standing = labels & ~low & (cloud.opacities >= SOLID)
    if not low.any() or not standing.any():
        return np.zeros(len(cloud), dtype=bool)
    return _farther(cloud, low, cloud.means[standing, :2].astype(np.float64), FOOT_M)


def hanging_off(cloud: SplatCloud, which: BoolArray, points: FloatArray) -> BoolArray:
    """(N,) those of some splats that hang well away from the object; all if `points` is empty.

    Args:
        cloud: the whole room, metres.
        which: (N,) splats found with the object.
        points: (K, 3) on the object.
    """
    return _farther(cloud, which, points, FAR_M) if len(points) else which


def _farther(cloud: SplatCloud, which: BoolArray, points: FloatArray, reach_m: float) -> BoolArray:
    """(N,) those of some splats that lie farther than that from all points (K, 2 or 3)."""
    far = np.zeros(len(cloud), dtype=bool)
    if which.any():
        at = cloud.means[which, : points.shape[1]].astype(np.float64)
        far[which] = KDTree(points).query(at)[0] > reach_m
    return far
