"""The uncertainty of a picture's pose from weak parallax, as how far its content may be off, px.

A pose that rests on few points in a corner of the picture, or on points that only its neighbours
and it have seen, fits those perfectly and shows everything else in the wrong place.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

MIN_ERROR_PX = 0.3
"""Features are never found better than this, however well a few of them fit."""
MEDIAN_LENGTH = math.sqrt(2 * math.log(2))
"""Of errors in two directions, in their standard deviations on an axis."""
GRID = (9, 7)
"""Places across and down a picture at which it is asked how far they might be off."""

FloatArray = NDArray[np.float64]


def pose_uncertainty_px(
    in_camera: FloatArray, errors_px: FloatArray, *, focal_px: float, size_px: tuple[int, int]
) -> float:
    """How far the picture's content may be off for its pose, as root mean square.

    To first order: the pose's covariance by the given points alone, carried to places all over the
    picture at the points' median depth.

    Args:
        in_camera: (N, 3) points that the pose rests on, in the camera's frame, whatever unit.
        errors_px: (N,) how far from their features they are drawn.
        focal_px: of the lens, taken as a pinhole.
        size_px: width and height of the picture.

    Returns:
        Pixels; infinite where the points leave the pose open.
    """
    ahead = in_camera[:, 2] > 0
    if ahead.sum() < 3:
        return float("inf")
    points = in_camera[ahead] / np.median(in_camera[ahead, 2])
    slope = _slope(points, focal_px).reshape(-1, 6)
    information = slope.T @ slope
    if np.linalg.cond(information) > 1e14:
        return float("inf")
    error_px = max(float(np.median(errors_px[ahead])) / MEDIAN_LENGTH, MIN_ERROR_PX)
    covariance = error_px**2 * np.linalg.inv(information)
    moved = _slope(_places(focal_px, size_px), focal_px)
    return float(np.sqrt(np.einsum("nij,jk,nik->n", moved, covariance, moved).mean()))


def _places(focal_px: float, size_px: tuple[int, int]) -> FloatArray:
    """(N, 3) places at depth 1 all over the picture."""
    x, y = (np.linspace(-0.5, 0.5, n) * s / focal_px for n, s in zip(GRID, size_px, strict=True))
    across, down = (v.ravel() for v in np.meshgrid(x, y))
    return np.stack([across, down, np.ones(across.size)], axis=1)


def _slope(points: FloatArray, focal_px: float) -> FloatArray:
    """(N, 2, 6) change of the pixel with the camera's shift and turn."""
    x, y, z = points.T
    zero = np.zeros(len(points))
    across = np.stack([1 / z, zero, -x / z**2], axis=1)
    down = np.stack([zero, 1 / z, -y / z**2], axis=1)
    by_place = focal_px * np.stack([across, down], axis=1)
    by_turn = -np.cross(by_place, points[:, None, :])
    return np.concatenate([by_place, by_turn], axis=2)
