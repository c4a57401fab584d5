"""Places for a camera in a room of splats: free, above a floor, away from surfaces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage as _ndimage  # pyright: ignore[reportMissingTypeStubs]

from scenes.cameras import Pinhole
from scenes.frames import WORLD_FROM_FORWARD_CAMERA, look_at
from scenes.pose import Pose, rotation_from_quaternion
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
image_filters: Any = _ndimage

CELL_M = 0.1
"""Side of a voxel, metres: less than a person's arm, more than most gaps between splats."""

MIN_WIDTH_M = 1.0
"""Of a room, metres."""

MAX_CELLS = 20_000_000
"""Voxels at most; cells grow in what is larger than a hall."""

MIN_OPACITY = 0.3
"""Fainter splats stop nobody."""

EYE_M = 1.3
"""Height of the 360° camera over the floor, metres, as the built-in rooms have it."""

HEIGHTS_M = (0.5, EYE_M, 2.0)
"""Heights that are looked from, metres: under tables, across the room, onto shelves."""

CLEARANCE_M = 0.35
"""Distance to the nearest surface, metres; a camera that is nearer sees little else."""

BELOW_CEILING_M = 0.3
"""Places end so far below the ceiling, metres."""

FLOOR_BAND_M = 0.15
"""Splats within so much of the floor's level make a column one with a floor, metres."""

PLACES = 14
"""Places to look from, at most: 84 views, so that two or more see a surface of a large room."""

VIEW_PX = 240
"""Size of the pictures by which a place is judged, px."""
VIEW_FOV_DEG = 100.0
"""Six views of 90° cover the sphere; the rest is overlap, as two views must agree on a surface."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeSpace:
    """Free places of a room.

    Attributes:
        stand_m: (3,) where the 360° camera stands, world metres.
        places_m: (N, 3) where to look from, world metres, N at least 1.
        footprint_m: (2, 2) lowest and highest floor corner (x, y).
    """

    stand_m: FloatArray
    places_m: FloatArray
    footprint_m: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Clearance:
    """Distance to the nearest surface, on a grid of cubes.

    Attributes:
        distance_m: (X, Y, Z) from the middle of each cube, metres.
        floor: (X, Y) where there is a floor, below furniture, too.
        low_m: (3,) lowest corner of the grid, world metres.
        cell_m: side of a cube, metres.
    """

    distance_m: FloatArray
    floor: NDArray[np.bool_]
    low_m: FloatArray
    cell_m: float


def find_free_space(room: SplatCloud, *, ceiling_m: float) -> FreeSpace:
    """Free places above the floor, spread over the room.

    Args:
        room: world frame, metres, the floor at z = 0.
        ceiling_m: height of the ceiling, or of the highest level surface.

    Raises:
        ValueError: nothing lies on the floor's level, or nothing above it is free.
    """
    around = clearance(room)
    low, cell, floor = around.low_m, around.cell_m, around.floor
    stand, places = _choose(around.distance_m, floor, low, cell, ceiling_m)
    columns = np.argwhere(floor)
    corners = np.quantile(columns, (0.005, 0.995), axis=0, method="nearest")
    footprint = low[:2] + cell * (corners + np.array([[0.0], [1.0]]))
    return FreeSpace(stand, places, footprint)


def clearance(room: SplatCloud) -> Clearance:
    """How far every place in and around a room is from its surfaces.

    Args:
        room: world frame, metres, the floor at z = 0.

    Raises:
        ValueError: the room is too small to stand in, or nothing lies on the floor's level.
    """
    points = _surface_points(room)
    low, high = np.quantile(points, (0.01, 0.99), axis=0)
    wide_m = float((high - low)[:2].max())
    if wide_m < MIN_WIDTH_M:
        raise ValueError(
            f"{wide_m:.2g} m wide, limit {MIN_WIDTH_M:g} m: no room that one can stand in; "
            "is the unit right?"
        )
    low, high = low - 0.5, high + 0.5
    low[2] = min(low[2], -0.5)
    x, y, z = (high - low).tolist()
    cell = max(CELL_M, (x * y * z / MAX_CELLS) ** (1 / 3))
    shape = np.ceil((high - low) / cell).astype(int) + 1
    index = np.floor((points - low) / cell).astype(int)
    index = index[((index >= 0) & (index < shape)).all(axis=1)]
    taken = np.zeros(shape, np.bool_)
    taken[tuple(index.T)] = True
    measured: Any = image_filters.distance_transform_edt(~taken)
    distance_m = cell * np.asarray(measured, np.float64)
    bands = np.floor((np.array([-FLOOR_BAND_M, FLOOR_BAND_M]) - low[2]) / cell).astype(int)
    floor = taken[:, :, max(0, bands[0]) : bands[1] + 1].any(axis=2)
    if not floor.any():
        raise ValueError("no splat lies on the floor's level, so there is no place to stand")
    # Splats under furniture are missing; columns between floor columns have a floor, too.
    closed: Any = image_filters.binary_closing(floor, iterations=round(0.4 / cell))
    floor = np.asarray(closed, np.bool_) | floor
    return Clearance(distance_m, floor, low, cell)


def views_from(places_m: FloatArray) -> list[tuple[Pinhole, Pose]]:
    """Six views from each place, each place turned by another angle; cameras and their poses."""
    camera = Pinhole.from_fov(VIEW_PX, VIEW_PX, math.radians(VIEW_FOV_DEG))
    views: list[tuple[Pinhole, Pose]] = []
    for number, eye in enumerate(places_m):
        start = number * math.pi * (3.0 - math.sqrt(5.0))
        for k in range(4):
            yaw = start + 0.5 * math.pi * k
            ahead = np.array([math.cos(yaw), math.sin(yaw), 0.0])
            views.append((camera, look_at(eye, eye + ahead)))
        views += [(camera, look_at(eye, eye + np.array([0.0, 0.0, z]))) for z in (-1.0, 1.0)]
    return views


def rig_at(stand_m: Sequence[float] | FloatArray) -> Pose:
    """`world_from_rig` of a level camera there."""
    return Pose(WORLD_FROM_FORWARD_CAMERA.rotation, np.asarray(stand_m, dtype=np.float64))


def _surface_points(room: SplatCloud) -> FloatArray:
    """(N, 3) centres of opaque splats and points on their two long axes, world metres."""
    opaque = room.opacities >= MIN_OPACITY
    means = room.means[opaque].astype(np.float64)
    scales = room.scales[opaque].astype(np.float64)
    axes = rotation_from_quaternion(room.rotations[opaque].astype(np.float64))
    order = np.argsort(scales, axis=1)
    points = [means]
    for rank in (1, 2):
        column = order[:, rank]
        length = np.take_along_axis(scales, column[:, None], axis=1)
        axis = np.take_along_axis(axes, column[:, None, None], axis=2)[:, :, 0]
        # A splat of metres is background, not a wall in the middle of the room.
        step = np.minimum(1.2 * length, 0.5) * axis
        points += [means + step, means - step]
    return np.concatenate(points)


def _choose(
    distance_m: FloatArray, floor: NDArray[np.bool_], low: FloatArray, cell: float, ceiling_m: float
) -> tuple[FloatArray, FloatArray]:
    """Choose the camera's place, and places far from each other at several heights."""
    candidates: list[FloatArray] = []
    clearances: list[FloatArray] = []
    for height_m in HEIGHTS_M:
        level = round((height_m - low[2]) / cell - 0.5)
        is_low = height_m > max(ceiling_m - BELOW_CEILING_M, HEIGHTS_M[0])
        if is_low or not 0 <= level < distance_m.shape[2]:
            continue
        clear = np.where(floor, distance_m[:, :, level], 0.0)
        cells = np.argwhere(clear >= CLEARANCE_M)
        candidates.append(
            np.column_stack([low[:2] + cell * (cells + 0.5), np.full(len(cells), height_m)])
        )
        clearances.append(clear[tuple(cells.T)])
    points, clear = (
        np.concatenate(candidates or [np.zeros((0, 3))]),
        np.concatenate(clearances or [np.zeros(0)]),
    )
    if not len(points):
        raise ValueError(
            f"nowhere above the floor is {CLEARANCE_M} m free on all sides, so no camera can "
            "stand there; is the unit right?"
        )
    at_eye = np.isclose(points[:, 2], EYE_M)
    first = int(np.argmax(np.where(at_eye | ~at_eye.any(), clear, 0.0)))
    chosen, far = [first], np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < min(PLACES, len(points)):
        following = int(np.argmax(far))
        if far[following] < 2 * CLEARANCE_M:
            break
        chosen.append(following)
        far = np.minimum(far, np.linalg.norm(points - points[following], axis=1))
    return points[first], points[chosen]
