"""Floor, walls and ceiling as half-spaces, so that nothing leaves, whatever the scan has missed.

Where a scanned wall is the outermost surface of the room it becomes a plane that nothing can
tunnel through. On the other sides the room ends at a plane where its scan ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.physics.collision.grid import Array, Grid
from sim.physics.collision.patches import Patches

PARALLEL = 0.985
"""Cosine of the angle between a patch and the plane it belongs to: 10 degrees."""
ON_PLANE_M = 0.025
"""How far from a plane a patch of it may lie: a headset's mesh bends by one or two centimetres."""
MIN_PLANE_M2 = 1.0
"""Surface that makes a wall."""
OUTSIDE_SHARE = 0.01
"""Share of all surface that may lie behind a wall: noise and shreds, no niche and no corridor."""
OUTLIER_SHARE = 0.001
"""Share of the surface left out when the scan's ends are looked for."""


@dataclass(frozen=True, slots=True)
class Plane:
    """A half-space that is solid.

    Attributes:
        normal: unit vector to the free side, world.
        offset_m: `normal · x` of its points.
        is_surface: whether a scanned surface lies there; else the scan only ends there.
    """

    normal: tuple[float, float, float]
    offset_m: float
    is_surface: bool

    def height(self, points: Array) -> Array:
        """(...) distances of points (..., 3) to the free side, metres."""
        return points @ np.asarray(self.normal) - self.offset_m


def planes_of(patches: Patches, grid: Grid) -> tuple[Plane, ...]:
    """Six half-spaces around the room: floor, ceiling and four sides.

    Args:
        patches: the whole surface; at least one.
        grid: its axes are the room's.
    """
    found: list[Plane] = []
    turn = grid.turn()
    for axis in range(3):
        for sign in (1.0, -1.0):
            found.append(_plane(patches, sign * turn[:, axis]))
    return tuple(found)


def off_planes(patches: Patches, planes: tuple[Plane, ...]) -> NDArray[np.bool_]:
    """(N,) which patches are still needed beside the planes."""
    needed = np.ones(len(patches), dtype=np.bool_)
    for plane in planes:
        height = plane.height(patches.centre)
        turned = patches.normal @ np.asarray(plane.normal)
        # What lies on a wall, and the back of what stands at it.
        on_plane = (np.abs(height) < ON_PLANE_M) & (np.abs(turned) > PARALLEL)
        needed &= ~(on_plane & plane.is_surface) & (height > -ON_PLANE_M)
    return needed


def _plane(patches: Patches, axis: Array) -> Plane:
    """The outermost surface against an axis, or else where the scan ends."""
    area = patches.area_m2
    height = patches.centre @ axis
    facing = patches.normal @ axis > PARALLEL
    end_m = _quantile(height, area, OUTLIER_SHARE)
    if area[facing].sum() > MIN_PLANE_M2:
        start_m = _quantile(height[facing], area[facing], 0.02)
        near = facing & (np.abs(height - start_m) < 2.0 * ON_PLANE_M)
        normal = _flattest(patches.centre[near], area[near], axis)
        heights = patches.centre @ normal
        offset_m = _quantile(heights[near], area[near], 0.5)
        on_plane = near & (np.abs(heights - offset_m) < ON_PLANE_M)
        outside = float(area[heights < offset_m - 2.0 * ON_PLANE_M].sum())
        if area[on_plane].sum() > MIN_PLANE_M2 and outside < OUTSIDE_SHARE * area.sum():
            offset_m = float(np.average(heights[on_plane], weights=area[on_plane]))
            return Plane(_tuple(normal), offset_m, is_surface=True)
    return Plane(_tuple(axis), end_m, is_surface=False)


def _quantile(values: Array, weights: Array, share: float) -> float:
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(reached, share * reached[-1])])


def _flattest(points: Array, weights: Array, axis: Array) -> Array:
    """Normal of the plane through points (N, 3), on the side of `axis`."""
    offset = points - np.average(points, axis=0, weights=weights)
    _, vectors = np.linalg.eigh((offset * weights[:, None]).T @ offset)
    return vectors[:, 0] * np.copysign(1.0, vectors[:, 0] @ axis)


def _tuple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return (x, y, z)
