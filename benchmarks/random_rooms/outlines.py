"""Upright boxes turned about the vertical: do they overlap, are they inside a room?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import BoxPart
from scenes.pose import Pose

FloatArray = NDArray[np.float64]
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
LEVEL_M = 1e-3
"""Boxes that overlap by less than this in height stand on each other."""


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """A box that is turned about the vertical only.

    Attributes:
        corners: (4, 2) of its plan, metres.
        low_m: its lowest height.
        high_m: its highest.
    """

    corners: FloatArray
    low_m: float
    high_m: float

    def is_inside(self, low: FloatArray, high: FloatArray) -> bool:
        """Whether its plan lies within a rectangle (2,), (2,)."""
        return bool((self.corners >= low).all() and (self.corners <= high).all())


def outline_of(box: BoxPart, world_from_object: Pose) -> Outline:
    """The outline of a box of an object that is turned about the vertical only."""
    x, y, z = box.half_size_m
    pose = world_from_object @ box.object_from_box
    flat = np.concatenate([CORNERS * (x, y), np.zeros((4, 1))], axis=1)
    middle = float(pose.translation[2])
    return Outline(np.asarray((pose @ flat)[:, :2]), middle - z, middle + z)


def upright(box_m: tuple[float, float, float], world_from_object: Pose) -> Outline:
    """The outline of an object's whole box; its origin is in the middle of the base."""
    x, y, z = (0.5 * side for side in box_m)
    return outline_of(BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, z)), (x, y, z)), world_from_object)


def overlaps(a: Outline, b: Outline, gap_m: float) -> bool:
    """Whether two boxes come closer than a gap in plan while they share some height."""
    if min(a.high_m, b.high_m) - max(a.low_m, b.low_m) < LEVEL_M:
        return False
    for corners in (a.corners, b.corners):
        for k in range(2):
            edge = corners[k + 1] - corners[k]
            axis = np.array([-edge[1], edge[0]]) / max(float(np.linalg.norm(edge)), 1e-12)
            p, q = a.corners @ axis, b.corners @ axis
            if p.min() - q.max() >= gap_m or q.min() - p.max() >= gap_m:
                return False
    return True
