"""Whether matches between pictures agree with poses that are given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose

FloatArray = NDArray[np.float64]


def epipolar_distances_px(
    first: FloatArray,
    second: FloatArray,
    cameras: tuple[Pinhole, Pinhole],
    second_from_first: Pose,
) -> FloatArray:
    """How far each match lies from the line on which it must lie (Sampson's distance).

    Args:
        first: (N, 2) pixels in the first picture.
        second: (N, 2) the same points in the second.
        cameras: of both.
        second_from_first: between the cameras; pixel distances mean nothing without a baseline.

    Returns:
        (N,) pixels; infinite where the cameras stand at one place.
    """
    t = second_from_first.translation
    if float(np.linalg.norm(t)) < 1e-9:
        return np.full(len(first), np.inf)
    cross = np.cross(np.eye(3), t / np.linalg.norm(t))
    essential = cross.T @ second_from_first.rotation
    inverse_a, inverse_b = (np.linalg.inv(_matrix(camera)) for camera in cameras)
    fundamental = inverse_b.T @ essential @ inverse_a
    a = np.column_stack([first, np.ones(len(first))])
    b = np.column_stack([second, np.ones(len(second))])
    line_in_b, line_in_a = a @ fundamental.T, b @ fundamental
    residual = np.einsum("nd,nd->n", b, line_in_b)
    slope = (line_in_b[:, :2] ** 2).sum(axis=1) + (line_in_a[:, :2] ** 2).sum(axis=1)
    return np.abs(residual) / np.sqrt(np.maximum(slope, 1e-18))


def _matrix(camera: Pinhole) -> FloatArray:
    return np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
