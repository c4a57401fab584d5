"""Remap tables from a fisheye picture to any other view, and virtual cameras aimed at a point."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.cameras import Camera, Fisheye, Pinhole, Rig, pixel_centres
from scenes.frames import look_at
from scenes.pose import Pose

FloatArray = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class WarpTable:
    """Source of each pixel of a view.

    Attributes:
        map_xy: (H, W, 2) float32 source position in `cv2.remap` coordinates (integer centres).
        valid: (H, W) bool, whether the source lens sees that direction.
    """

    map_xy: FloatArray
    valid: NDArray[np.bool_]


def warp_table(source: Camera, target: Pinhole | Fisheye, source_from_target: Pose) -> WarpTable:
    """Table that takes a picture of `source` to the view of `target`, both at the same centre.

    Args:
        source: lens the picture was taken with.
        target: camera of the wanted view.
        source_from_target: only its rotation counts: one lens does not measure depth.
    """
    rays = target.unproject(pixel_centres(target)) @ source_from_target.rotation.T
    pixels, valid = source.project(rays)
    shape = (target.height_px, target.width_px)
    map_xy = (pixels - 0.5).astype(np.float32).reshape(*shape, 2)
    return WarpTable(np.ascontiguousarray(map_xy), valid.reshape(shape))


def warp(image: NDArray[np.uint8] | FloatArray, table: WarpTable) -> NDArray[np.uint8] | FloatArray:
    """The picture seen through the table: (H, W, C) or (H, W), same type; 0 where not visible."""
    return cv2.remap(  # pyright: ignore[reportReturnType]
        image,
        table.map_xy[..., 0],
        table.map_xy[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=0,
    )


@dataclass(frozen=True, slots=True, eq=False)
class VirtualView:
    """A pinhole camera that shares its centre with one lens of a rig.

    Attributes:
        lens: index of the lens it takes its picture from.
        camera: the pinhole.
        world_from_camera: its pose.
        table: how to make its picture from the lens's picture.
        target: (3,) world point at its centre, or a point 1 m ahead.
    """

    lens: int
    camera: Pinhole
    world_from_camera: Pose
    table: WarpTable
    target: NDArray[np.float64]


def best_lens(rig: Rig, world_from_rig: Pose, point_in_world: ArrayLike) -> int:
    """Index of the lens whose axis points nearest to a world point."""
    point = np.asarray(point_in_world, dtype=np.float64)
    angles = [
        _angle_off_axis((world_from_rig @ rig_from_lens).inverse() @ point)
        for rig_from_lens in rig.rig_from_lens
    ]
    return int(np.argmin(angles))


def view_towards(
    rig: Rig,
    world_from_rig: Pose,
    point_in_world: ArrayLike,
    *,
    size_px: tuple[int, int],
    focal_px: float | None = None,
    lens: int | None = None,
) -> VirtualView:
    """A level pinhole view aimed at a world point, through the lens that sees it best.

    Args:
        rig: the 360° camera.
        world_from_rig: its pose.
        point_in_world: (3,) metres; appears at the centre of the view.
        size_px: (width, height).
        focal_px: focal length; by default the lens's own resolution (pixels per radian).
        lens: take this lens instead of the best one.
    """
    point = np.asarray(point_in_world, dtype=np.float64)
    chosen = best_lens(rig, world_from_rig, point) if lens is None else lens
    world_from_lens = world_from_rig @ rig.rig_from_lens[chosen]
    source = rig.lenses[chosen]
    focal = source.f_px if focal_px is None else focal_px
    width, height = size_px
    camera = Pinhole(width, height, focal, focal, 0.5 * width, 0.5 * height)
    world_from_camera = look_at(world_from_lens.translation, point)
    table = warp_table(source, camera, world_from_lens.inverse() @ world_from_camera)
    return VirtualView(chosen, camera, world_from_camera, table, point)


def front_view(rig: Rig, world_from_rig: Pose, *, size_px: int, fov: float) -> VirtualView:
    """The square rectified view along the front lens's axis (paper 4.4.1); `fov` in radians."""
    camera = Pinhole.from_fov(size_px, size_px, fov)
    table = warp_table(rig.lenses[0], camera, Pose.identity())
    world_from_lens = world_from_rig @ rig.rig_from_lens[0]
    ahead = world_from_lens @ np.array([0.0, 0.0, 1.0])
    return VirtualView(0, camera, world_from_lens, table, ahead)


def _angle_off_axis(point_in_lens: NDArray[np.float64]) -> float:
    x, y, z = point_in_lens
    return math.atan2(math.hypot(x, y), z)
