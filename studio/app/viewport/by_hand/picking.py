"""Picking by a pixel: an object, a body, or a place in the room."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose

MARGIN_M = 0.03
"""How far a picked place may be outside an object's box and still be it: a scan's splats stick out
by about this, metres."""

Boxes = Mapping[str, tuple[Pose, tuple[float, float, float]]]
"""By id: pose of the base and extents; a box stands on its base."""


@dataclass(frozen=True, slots=True, eq=False)
class Pick:
    """The item or place that was picked.

    Attributes:
        item_id: of the object or body; "" is the room.
        point: (3,) world metres.
    """

    item_id: str
    point: NDArray[np.float64]


def ray_of(
    camera: Pinhole, world_from_camera: Pose, x_px: float, y_px: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(3,) the eye and (3,) the unit direction of a pixel, in the world."""
    ray = camera.unproject(np.array([[x_px, y_px]]))[0]
    return world_from_camera.translation, world_from_camera.rotation @ ray


def point_at(
    depth: NDArray[np.float32],
    camera: Pinhole,
    world_from_camera: Pose,
    x_px: float,
    y_px: float,
) -> NDArray[np.float64] | None:
    """(3,) world place that a pixel shows; None where nothing is.

    Args:
        depth: (h, w) metres along z, of the same view in any size.
        camera: that the pixel belongs to.
        world_from_camera: its pose.
        x_px: the pixel, from the left.
        y_px: the pixel, from the top.
    """
    height, width = depth.shape
    row = min(max(int(y_px * height / camera.height_px), 0), height - 1)
    column = min(max(int(x_px * width / camera.width_px), 0), width - 1)
    z = float(depth[row, column])
    if z <= 0:
        return None
    ray = camera.unproject(np.array([[x_px, y_px]]))[0]
    return world_from_camera @ (ray * (z / ray[2]))


def pick(
    boxes: Boxes,
    depth: NDArray[np.float32],
    camera: Pinhole,
    world_from_camera: Pose,
    x_px: float,
    y_px: float,
) -> Pick | None:
    """Pick what a pixel shows: the smallest box that holds the place, else the room, or None."""
    point = point_at(depth, camera, world_from_camera, x_px, y_px)
    if point is None:
        return None
    holding = [
        (float(np.prod(size)), item_id)
        for item_id, (pose, size) in boxes.items()
        if _holds(pose, size, point)
    ]
    return Pick(min(holding)[1] if holding else "", point)


def met_plane(
    eye: NDArray[np.float64],
    ray: NDArray[np.float64],
    *,
    point: NDArray[np.float64],
    normal: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """(3,) where a ray meets a plane ahead of the eye; None if it does not."""
    slope = float(normal @ ray)
    if abs(slope) < 1e-6:
        return None
    along = float(normal @ (point - eye)) / slope
    return eye + along * ray if along > 0 else None


def nearest_on_line(
    eye: NDArray[np.float64],
    ray: NDArray[np.float64],
    *,
    point: NDArray[np.float64],
    axis: NDArray[np.float64],
) -> float | None:
    """How far along a line (unit axis) a ray comes nearest to it; None where they are parallel."""
    cross = float(axis @ ray)
    denominator = 1.0 - cross**2
    if denominator < 1e-6:
        return None
    between = point - eye
    return float((cross * (ray @ between) - axis @ between) / denominator)


def length_m(points: Sequence[NDArray[np.float64]]) -> float:
    """Length of a path through places, metres."""
    return float(sum(np.linalg.norm(b - a) for a, b in pairwise(points)))


def _holds(pose: Pose, size: tuple[float, float, float], point: NDArray[np.float64]) -> bool:
    local = pose.inverse() @ point
    half = np.array([0.5 * size[0], 0.5 * size[1]])
    inside = (np.abs(local[:2]) <= half + MARGIN_M).all()
    # A place on the floor just beside the base is the floor, not the object.
    return bool(inside and 0.01 <= local[2] <= size[2] + MARGIN_M)
