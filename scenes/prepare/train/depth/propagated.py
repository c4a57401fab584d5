"""Depth that a view has not seen itself, propagated from neighbouring views that have.

Stereo needs two photos that show the same from a little aside, and texture. Where a view lacks
either, other views often saw the place: their points are drawn into it, the nearest in front.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose

SAME_SURFACE = 0.02
"""Points up to this share of its depth behind the nearest one are of its surface."""
MIN_POINTS = 2
"""A pixel has to be shown by so many, or the nearest might be a stray."""
HOLE_PX = 3
"""Pixels without a point take the nearest surface in a window of this width."""
POINTS_AT_ONCE = 50_000
"""So that what is worked on stays in the cache."""

Points = NDArray[np.float32]


def propagated_depth(
    camera: Pinhole, world_from_camera: Pose, points: Points
) -> NDArray[np.float32]:
    """(H, W) float32 z of the surfaces that points show; 0 where none is.

    Args:
        camera: the lens.
        world_from_camera: where it is.
        points: (N, 3) world, dense on surfaces.
    """
    size = camera.width_px * camera.height_px
    pixel, z = _draw(camera, world_from_camera, points)
    first = np.full(size, np.inf, dtype=np.float32)
    np.minimum.at(first, pixel, z)
    # A gap in what is near would show what lies behind it.
    shape = (camera.height_px, camera.width_px)
    around = np.ones((HOLE_PX, HOLE_PX), dtype=np.uint8)
    first = np.asarray(cv2.erode(first.reshape(shape), around)).ravel()
    is_same = z <= first[pixel] * (1 + SAME_SURFACE)
    total = np.bincount(pixel[is_same], z[is_same], size)
    count = np.bincount(pixel[is_same], minlength=size)
    is_known = count >= MIN_POINTS
    return np.where(is_known, total / np.maximum(count, 1), 0).astype(np.float32).reshape(shape)


def _draw(
    camera: Pinhole, world_from_camera: Pose, points: Points
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Pixel and z of the points in the picture."""
    camera_from_world = world_from_camera.rotation.astype(np.float32).T
    eye = world_from_camera.translation.astype(np.float32)
    pixels, depths = [np.zeros(0, dtype=np.intp)], [np.zeros(0, dtype=np.float32)]
    for start in range(0, len(points), POINTS_AT_ONCE):
        x, y, z = camera_from_world @ (points[start : start + POINTS_AT_ONCE] - eye).T
        with np.errstate(divide="ignore", invalid="ignore"):
            column = np.floor(camera.fx * x / z + camera.cx)
            row = np.floor(camera.fy * y / z + camera.cy)
        inside = (z > 0) & (column >= 0) & (column < camera.width_px)
        inside &= (row >= 0) & (row < camera.height_px)
        at = row[inside].astype(np.intp) * camera.width_px + column[inside].astype(np.intp)
        pixels.append(at)
        depths.append(z[inside])
    return np.concatenate(pixels), np.concatenate(depths)
