"""A 360° camera's picture as pinhole views, which structure from motion treats like photos."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole, Rig
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.footage.capture import CaptureError
from scenes.warp import WarpTable, warp, warp_table

FIELD_OF_VIEW = math.radians(90.0)
"""Field of view of each view, radians."""
WIDEST_YAW = math.radians(60.0)
"""Turn of the outer views from the lens's axis at most, radians."""


@dataclass(frozen=True, slots=True)
class PanoramaView:
    """One pinhole view.

    Attributes:
        label: lens and direction, such as "0_left".
        lens: index of the lens it looks through.
        camera: its pinhole.
        lens_from_view: a rotation.
        table: how to make its picture from the lens's.
    """

    label: str
    lens: int
    camera: Pinhole
    lens_from_view: Pose
    table: WarpTable


def panorama_views(rig: Rig) -> tuple[PanoramaView, ...]:
    """Left, middle and right view of each lens, at the lens's own resolution.

    Two lenses back to back give a closed ring with overlap.
    """
    return tuple(
        _view(number, lens, direction, yaw)
        for number, lens in enumerate(rig.lenses)
        for direction, yaw in _directions(lens)
    )


def view_pictures(
    picture: NDArray[np.uint8], rig: Rig, views: tuple[PanoramaView, ...]
) -> list[NDArray[np.uint8]]:
    """The views' pictures from one with all lenses side by side, (H, lenses · W, 3).

    Raises:
        CaptureError: the picture is not of the rig's size.
    """
    widths = [lens.width_px for lens in rig.lenses]
    height, width = picture.shape[:2]
    if width != sum(widths) or any(lens.height_px != height for lens in rig.lenses):
        raise CaptureError(
            f"a picture of {width}×{height} px, but the 360° camera's lenses side by side give "
            f"{sum(widths)}×{rig.lenses[0].height_px}; give the file that belongs to this camera"
        )
    lenses = np.split(picture, np.cumsum(widths)[:-1], axis=1)
    return [np.asarray(warp(lenses[view.lens], view.table), dtype=np.uint8) for view in views]


def _directions(lens: Fisheye) -> tuple[tuple[str, float], ...]:
    yaw = min(WIDEST_YAW, lens.max_angle - FIELD_OF_VIEW / 2)
    if yaw <= 0:
        return (("middle", 0.0),)
    return (("left", -yaw), ("middle", 0.0), ("right", yaw))


def _view(number: int, lens: Fisheye, direction: str, yaw: float) -> PanoramaView:
    size = max(16, round(2 * lens.f_px * math.tan(FIELD_OF_VIEW / 2)))
    camera = Pinhole.from_fov(size, size, FIELD_OF_VIEW)
    lens_from_view = Pose(rotation_from_vector([0.0, yaw, 0.0]), np.zeros(3))
    table = warp_table(lens, camera, lens_from_view)
    return PanoramaView(f"{number}_{direction}", number, camera, lens_from_view, table)
