"""Displacements of windows: from the drawn room to the live picture of one lens.

What a window says is independent of whether it agrees with the pose, other than single pixels' grey
values, of which those that lie where both pictures are steep confirm any pose.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from tracking.camera.lens_view import Sight

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

MIN_USABLE = 0.5
"""Least share of a window that can be used."""

MIN_SLOPE = 0.002
"""Root mean square of a window's gradient, grey 0..1 per px, below which it says nothing."""

MIN_CORRELATION = 0.6
"""Correlation of a window with the live picture from which it is taken for the same place. People
who stand before the room halve the correlation: at 0.3 instead a person before a 640-px lens turns
the camera by 0.17° instead of 0.08°."""

MIN_RESIDUAL = 0.02
"""Least residual variance of a window against its own: better than a seventh of the contrast is no
measurement of the scan."""

WINDOW_SIGMA_PX = 0.2
"""Error in px of a window's displacement that its own residual does not show: the scan's splats."""


@dataclass(frozen=True, slots=True, eq=False)
class Displacements:
    """Displacements of N windows of one lens. Angles are pixels over the lens's focal length.

    Attributes:
        pixels: (N, 2) centres in px of the lens at `f_px`.
        f_px: px per radian of the pictures that were compared.
        shift: (N, 2) from drawn to live, radians.
        by_twist: (N, 2, 6) its derivative by a twist of the rig in its own axes.
        information: (N, 2, 2) inverse covariance of `shift`.
        range_m: (N,) distance of the surface.
        share: 0..1, of all windows with texture those that were found.
    """

    pixels: Points
    f_px: float
    shift: Points
    by_twist: Points
    information: Points
    range_m: Points
    share: float


def displacements(
    sight: Sight,
    camera: Fisheye,
    pixels: Points,
    shift_px: Points,
    information: Points,
    *,
    range_m: Points,
    facing: Points,
    share: float,
) -> Displacements:
    """Displacements in angles, with what a twist of the rig does to them.

    Args:
        sight: the lens.
        camera: the lens at the size of the compared pictures.
        pixels: (N, 2) centres of the windows in it.
        shift_px: (N, 2) their displacements, from drawn to live.
        information: (N, 2, 2) inverse covariance of those, 1/px².
        range_m: (N,) distance of the surface.
        facing: (N,) cosine between sight and its normal; slanted surfaces count less.
        share: of all windows with texture those that were found.
    """
    covariance = np.linalg.inv(information + 1e-6 * np.eye(2)) + WINDOW_SIGMA_PX**2 * np.eye(2)
    weight = facing**2
    in_rig = sight.rig_from_lens @ (camera.unproject(pixels) * range_m[:, None])
    lens_from_rig = sight.rig_from_lens.inverse()
    there, _ = camera.project(lens_from_rig @ in_rig)
    by_twist = np.empty((len(pixels), 2, 6))
    small = 1e-4
    for axis in range(6):
        # The rig moves by the twist, so points seen from it move by its inverse.
        unit = np.zeros(3)
        unit[axis % 3] = small
        moved = in_rig - np.cross(unit, in_rig) if axis < 3 else in_rig - unit
        by_twist[:, :, axis] = (camera.project(lens_from_rig @ moved)[0] - there) / small
    f_px = camera.f_px
    return Displacements(
        pixels,
        f_px,
        shift_px / f_px,
        by_twist / f_px,
        np.linalg.inv(covariance) * (weight * f_px**2)[:, None, None],
        range_m,
        share,
    )


def noise_area(blur_px: float) -> float:
    """Pixels that share one independent value of white noise after a Gaussian blur."""
    return 4.0 * math.pi * blur_px**2


def tensors(products: Sequence[FloatArray]) -> Points:
    """(N, 2, 2) from xx, xy and yy."""
    xx, xy, yy = (product.astype(np.float64) for product in products)
    return np.stack([xx, xy, xy, yy], axis=-1).reshape(-1, 2, 2)
