"""The part of a picture that an object's splats reach: nothing need be drawn beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.splats import SplatCloud

REACH_SIGMAS = 3.4
"""Farther from its middle a splat is not drawn: its opacity is below 1/255."""

STRETCH = 1.6
"""A fisheye widens what is seen far from its axis by at most about this, across the radius."""


def extent(
    splats: SplatCloud, camera: Fisheye, camera_from_object: Pose, *, margin_px: int
) -> tuple[slice, slice]:
    """Rows and columns of a picture that an object's splats reach, with a margin; at least one.

    Args:
        splats: in the object's frame.
        camera: of the picture.
        camera_from_object: where the object is.
        margin_px: added on every side, within the picture.
    """
    places = camera_from_object @ splats.means.astype(np.float64)
    pixels, _ = camera.project(places)
    distance = np.linalg.norm(places, axis=1)
    sigma_px = camera.f_px * splats.scales.max(axis=1) / np.maximum(distance, 1e-6)
    reach = (STRETCH * REACH_SIGMAS * sigma_px)[:, None]
    low = np.floor((pixels - reach).min(axis=0)) - margin_px
    high = np.ceil((pixels + reach).max(axis=0)) + margin_px
    columns = _within(low[0], high[0], camera.width_px)
    return _within(low[1], high[1], camera.height_px), columns


def _within(low: float, high: float, size: int) -> slice:
    first = int(min(max(low, 0), size - 1))
    return slice(first, int(max(min(high, size), first + 1)))


def part_of(camera: Fisheye, part: tuple[slice, slice]) -> Fisheye:
    """The camera of some rows and columns of a picture."""
    rows, columns = part
    return replace(
        camera,
        width_px=columns.stop - columns.start,
        height_px=rows.stop - rows.start,
        cx=camera.cx - columns.start,
        cy=camera.cy - rows.start,
    )
