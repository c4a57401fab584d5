"""Up direction and floor of a reconstruction.

Two sources, the better first. The floor: the lowest large level plane of the sparse points. Before
it, and where there is none: people hold a camera level, so that the photos' own x axes are
horizontal on the average. A code's direction is not used: codes are taped up by eye.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.align.similarity import Similarity
from scenes.prepare.reconstruction import Reconstruction

FloatArray = NDArray[np.float64]

CAMERA_TILT_DEG = 3.0
"""How far off the up direction from the cameras alone may well be."""

SEARCH_TILT_DEG = 15.0
"""Tilt from the first estimate of up within which a floor is looked for, degrees."""
MIN_POINTS = 40
"""Points on a floor at least, and below the cameras to look for one."""
MIN_FLOOR_SHARE = 0.01
"""Share of all points that lie on a floor at least."""
TRIES = 2000
"""Planes through three random points that are tried."""
MAX_SHARE_BELOW = 0.04
"""A floor has at most this share of all points below it; a table top has more."""


@dataclass(frozen=True, slots=True, eq=False)
class Gravity:
    """Up and floor in a reconstruction's own frame and units.

    Attributes:
        up: (3,) unit vector.
        floor: height of the floor along `up`: `up @ x = floor` for x on it.
        tilt_sigma_deg: standard deviation of `up`.
        floor_sigma: standard deviation of `floor` below the middle of the floor's points.
        floor_points: how many sparse points lie on the floor; 0 if none was found, then `floor` is
            the height that 1 % of the points are below.
    """

    up: FloatArray
    floor: float
    tilt_sigma_deg: float
    floor_sigma: float
    floor_points: int


def find_gravity(reconstruction: Reconstruction, *, rng: np.random.Generator) -> Gravity:
    """Up and floor from the photos' poses and the sparse points.

    Raises:
        ValueError: there are no views.
    """
    up = up_from_cameras(reconstruction)
    points = reconstruction.points
    if len(points) < MIN_POINTS:
        lowest = min(float(up @ v.world_from_camera.translation) for v in reconstruction.views)
        return Gravity(up, lowest, CAMERA_TILT_DEG, math.inf, 0)
    eyes = np.stack([v.world_from_camera.translation for v in reconstruction.views])
    heights = points @ up
    eye_height = float(np.median(eyes @ up))
    reach = eye_height - float(np.quantile(heights, 0.01))
    floor = _floor_plane(points, up, eye_height, 0.01 * max(reach, 1e-9), rng)
    if floor is None:
        return Gravity(up, float(np.quantile(heights, 0.01)), CAMERA_TILT_DEG, 0.05 * reach, 0)
    return floor


def standing_world(
    gravity: Gravity, place: FloatArray, facing: FloatArray, metres_per_unit: float
) -> Similarity:
    """The metric world (world from reconstruction): Z up, its origin on the floor under `place`.

    Args:
        gravity: up and floor.
        place: (3,) in the reconstruction's frame.
        facing: (3,) a direction whose level part is X.
        metres_per_unit: the scale.
    """
    x = facing - (facing @ gravity.up) * gravity.up
    x /= np.linalg.norm(x)
    rotation = np.array([x, np.cross(gravity.up, x), gravity.up], dtype=np.float64)
    foot = place - (gravity.up @ place - gravity.floor) * gravity.up
    return Similarity(metres_per_unit, rotation, -metres_per_unit * rotation @ foot)


def up_from_cameras(reconstruction: Reconstruction) -> FloatArray:
    """(3,) the direction that the photos' x axes are square to, on the side of their tops.

    Raises:
        ValueError: there are no views.
    """
    if not reconstruction.views:
        raise ValueError("gravity: the reconstruction has no views; wanted at least one")
    rotations = np.stack([v.world_from_camera.rotation for v in reconstruction.views])
    right, down = rotations[:, :, 0], rotations[:, :, 1]
    mean_up = -down.mean(axis=0)
    mean_up /= max(float(np.linalg.norm(mean_up)), 1e-12)
    # Photos in one direction leave up free about their x axis: the mean decides there.
    spread = right.T @ right / len(right) - 0.02 * np.outer(mean_up, mean_up)
    up = np.linalg.eigh(spread)[1][:, 0]
    return up if float(up @ mean_up) >= 0 else -up


def _floor_plane(
    points: FloatArray, up: FloatArray, eye_height: float, near: float, rng: np.random.Generator
) -> Gravity | None:
    """The lowest of the large level planes below the cameras (RANSAC, then least squares)."""
    heights = points @ up
    below = points[heights < eye_height - 10 * near]
    if len(below) < MIN_POINTS:
        return None
    picks = rng.integers(len(below), size=(TRIES, 3))
    a, b, c = (below[picks[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(length, 1e-12)[:, None]
    normals *= np.sign(normals @ up)[:, None]
    level = (normals @ up > math.cos(math.radians(SEARCH_TILT_DEG))) & (length > near * near)
    normals, offsets = normals[level], np.einsum("na,na->n", normals[level], a[level])
    best: tuple[float, FloatArray, float] | None = None
    for normal, offset in zip(normals, offsets, strict=True):
        off = points @ normal - offset
        on = int(np.count_nonzero(np.abs(off) < near))
        if on < max(MIN_POINTS, MIN_FLOOR_SHARE * len(points)):
            continue
        if np.count_nonzero(off < -3 * near) > MAX_SHARE_BELOW * len(points):
            continue
        if best is None or on > best[0]:
            best = (on, normal, float(offset))
    if best is None:
        return None
    return _fit(points, best[1], best[2], near)


def _fit(points: FloatArray, up: FloatArray, floor: float, near: float) -> Gravity:
    on = points
    for _ in range(5):
        on = points[np.abs(points @ up - floor) < near]
        centre = on.mean(axis=0)
        _, axes = np.linalg.eigh((on - centre).T @ (on - centre))
        up = axes[:, 0] * np.sign(axes[:, 0] @ up)
        floor = float(up @ centre)
    off = on @ up - floor
    spread = np.sqrt(np.linalg.eigvalsh((on - on.mean(axis=0)).T @ (on - on.mean(axis=0))))
    sigma = float(off.std())
    tilt = math.degrees(sigma / max(float(spread[1]), 1e-12))
    return Gravity(up, floor, tilt, sigma / math.sqrt(len(on)), len(on))
