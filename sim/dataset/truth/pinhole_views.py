"""Pinhole views cut out of a fisheye: picture, ids, silhouettes and depth.

A 200° fisheye has no pinhole picture; formats that know pinholes only get several views of 90°,
each a camera of its own that stands where the lens stands.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole, pixel_centres
from scenes.pose import Pose, rotation_from_vector
from sim.dataset.truth.lens_truth import LensTruth

VIEW_FOV_DEG = 90.0
"""Horizontal and vertical field of view of a view, degrees."""

VIEW_YAWS_DEG = (-60.0, 0.0, 60.0)
"""To the right of the lens's axis, degrees: three views cover a lens's half of the room with 30° of
overlap."""

VIEW_PITCH_DEG = 25.0
"""Downwards, degrees: floor and tables, where objects stand, and no camera's stand."""

SMOOTH_SHARE = 0.02
"""Range is interpolated where its neighbours differ by less than this share; else the nearest."""


@dataclass(frozen=True, slots=True, eq=False)
class PinholeView:
    """A pinhole camera inside a lens.

    Attributes:
        camera: its picture.
        lens_from_view: its pose in the lens; a rotation.
    """

    camera: Pinhole
    lens_from_view: Pose


@dataclass(frozen=True, slots=True, eq=False)
class ViewTruth:
    """The truth of a view.

    Attributes:
        world_from_view: true pose.
        depth_m: (H, W) float32 z; 0 where nothing is.
        ids: (H, W) uint8, as in `LensTruth`.
        silhouettes: (H, W) bool per object that is at least partly in the picture.
    """

    world_from_view: Pose
    depth_m: NDArray[np.float32]
    ids: NDArray[np.uint8]
    silhouettes: Mapping[str, NDArray[np.bool_]]


def views_in(lens: Fisheye, size_px: int | None = None) -> tuple[PinholeView, ...]:
    """The views of one lens of a level camera; as fine in their middle as the lens by default."""
    half = math.radians(VIEW_FOV_DEG) / 2
    size = size_px or max(16, 2 * round(lens.f_px * math.tan(half)))
    camera = Pinhole.from_fov(size, size, 2 * half)
    down = rotation_from_vector(np.array([-math.radians(VIEW_PITCH_DEG), 0.0, 0.0]))
    return tuple(
        PinholeView(
            camera,
            Pose(rotation_from_vector(np.array([0.0, math.radians(yaw), 0.0])) @ down, np.zeros(3)),
        )
        for yaw in VIEW_YAWS_DEG
    )


class ViewSampler:
    """Resamples a lens's pictures for one view; the geometry is computed once.

    Args:
        lens: the fisheye in the pixels of what is sampled.
        view: the camera wanted.
    """

    def __init__(self, lens: Fisheye, view: PinholeView) -> None:
        self._view = view
        camera = view.camera
        rays = camera.unproject(pixel_centres(camera))
        pixels, seen = lens.project(rays @ view.lens_from_view.rotation.T)
        shape = (camera.height_px, camera.width_px)
        # cv2.remap samples at whole numbers, where pixel centres are.
        self._x = np.where(seen, pixels[:, 0] - 0.5, -1e4).astype(np.float32).reshape(shape)
        self._y = np.where(seen, pixels[:, 1] - 0.5, -1e4).astype(np.float32).reshape(shape)
        self._cosine = rays[:, 2].astype(np.float32).reshape(shape)

    def picture(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """(H, W, 3) of the view, bilinear; black outside the lens."""
        return np.asarray(cv2.remap(rgb, self._x, self._y, cv2.INTER_LINEAR), np.uint8)

    def truth(self, truth: LensTruth) -> ViewTruth:
        """Ids and silhouettes of the nearest pixel; depth = range · cos, smooth on surfaces."""
        silhouettes: dict[str, NDArray[np.bool_]] = {}
        for name, alone in truth.silhouettes.items():
            mask = self._nearest(
                alone.mask.astype(np.uint8), shift=(alone.rect.x0, alone.rect.y0)
            ).view(np.bool_)
            if mask.any():
                silhouettes[name] = mask
        return ViewTruth(
            truth.world_from_lens @ self._view.lens_from_view,
            self._range(truth.range_m) * self._cosine,
            self._nearest(truth.ids),
            silhouettes,
        )

    def _range(self, range_m: NDArray[np.float32]) -> NDArray[np.float32]:
        """Range of a view's pixels, metres; 0 where nothing is.

        1 / range is nearly linear over a pixel of a plane, at whatever slant.
        """
        near = np.where(np.isfinite(range_m), 1.0 / range_m, 0.0).astype(np.float32)
        nearest = self._nearest(near)
        between = np.asarray(cv2.remap(near, self._x, self._y, cv2.INTER_LINEAR), np.float32)
        is_smooth = np.abs(between - nearest) < SMOOTH_SHARE * nearest
        inverse = np.where(is_smooth, between, nearest)
        return np.where(inverse > 0, 1.0 / np.maximum(inverse, 1e-6), 0.0).astype(np.float32)

    def _nearest(self, values: NDArray[Any], *, shift: tuple[int, int] = (0, 0)) -> NDArray[Any]:
        x, y = np.rint(self._x).astype(np.int64) - shift[0], np.rint(self._y).astype(np.int64)
        y = y - shift[1]
        height, width = values.shape
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        taken = values[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
        return np.where(inside, taken, np.zeros(1, values.dtype))
