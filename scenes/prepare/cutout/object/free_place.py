# pyright: standard
"""A place on the floor of a room where a new object stands free."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.package import ScenePackage

CELL_M = 0.05
"""Side of a cell of the floor, metres."""
FLOOR_REACH_M = 0.05
"""Splats this near to z = 0 are floor."""
GAP_M = 0.3
"""Between splats of the floor: what is wider is no floor."""
CLEAR_M = 0.08
"""Height above which an object is in the way."""
BESIDE_M = 0.15
"""Kept free around the object."""
SOLID = 0.3
"""Opacity from which on a splat counts."""


def free_place(package: ScenePackage, box_m: tuple[float, float, float]) -> tuple[float, float]:
    """World (x, y) of the free place on the floor that is nearest to the room's middle.

    Args:
        package: the room and what stands in it.
        box_m: extents of the object, which is free there however it is turned.

    Raises:
        ValueError: the floor has no such place.
    """
    low, high = package.footprint_m
    clearance_m = floor_clearance_m(package, float(box_m[2]))
    radius_m = 0.5 * float(np.hypot(box_m[0], box_m[1])) + BESIDE_M
    free = np.argwhere(clearance_m > radius_m)
    if not len(free):
        raise ValueError(
            f"no place on the floor has {2 * radius_m:.2f} m free all around; say where the object "
            "shall stand with --at X,Y"
        )
    places = low + (free[:, ::-1] + 0.5) * CELL_M
    away = np.linalg.norm(places - 0.5 * (low + high), axis=1)
    x, y = places[int(np.argmin(away))]
    return float(x), float(y)


def floor_clearance_m(package: ScenePackage, height_m: float) -> NDArray[np.float32]:
    """(rows, columns) distance from each cell of the floor to the nearest that is not free, metres.

    Cells are `CELL_M` wide, from the footprint's lowest corner, y along rows; 0 where no floor was
    seen, or something is in the way of what is `height_m` tall.
    """
    low, high = package.footprint_m
    columns, rows = np.maximum(np.ceil((high - low) / CELL_M).astype(int), 1)
    floor, taken = _floor_and_taken(package, height_m, (rows, columns))
    reach = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * round(GAP_M / 2 / CELL_M) + 1,) * 2)
    open_floor = (cv2.morphologyEx(floor, cv2.MORPH_CLOSE, reach) > 0) & (taken == 0)
    # The footprint's edge ends the room.
    padded = np.pad(open_floor.astype(np.uint8), 1)
    return (CELL_M * cv2.distanceTransform(padded, cv2.DIST_L2, 5)[1:-1, 1:-1]).astype(np.float32)


def _floor_and_taken(
    package: ScenePackage, height_m: float, shape: tuple[int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """(rows, columns) each: where floor was seen, and where something is in the way."""
    low = package.footprint_m[0]
    floor, taken = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    room = package.room
    heights = room.means[:, 2]
    solid = room.opacities >= SOLID
    in_the_way = solid & (heights > CLEAR_M) & (heights < height_m + BESIDE_M)
    for kind, canvas in ((solid & (np.abs(heights) < FLOOR_REACH_M), floor), (in_the_way, taken)):
        cell = np.floor((room.means[kind, :2] - low) / CELL_M).astype(int)
        within = ((cell >= 0) & (cell < shape[::-1])).all(axis=1)
        canvas[cell[within, 1], cell[within, 0]] = 1
    for item in package.objects:
        x, y = 0.5 * item.box_m[0], 0.5 * item.box_m[1]
        corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
        plan = (item.world_from_object @ corners)[:, :2]
        cv2.fillConvexPoly(taken, np.round((plan - low) / CELL_M - 0.5).astype(np.int32), 1)
    return floor, taken
