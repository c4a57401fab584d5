"""Free floor of a room for people, on a grid, worked out once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage  # pyright: ignore[reportMissingTypeStubs]

from scenes.mesh import PhysicalRoom
from sim.physics.collision.grid import area_vectors
from sim.physics.collision.surface import triangles_of
from sim.physics.scanned.surface import without_objects

_NDIMAGE: Any = cast(Any, ndimage)
"""SciPy has no types; it measures distances and labels regions."""

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CELL_M = 0.08
BODY_RADIUS_M = 0.24
OBJECT_MARGIN_M = 0.20
LOW_M, HIGH_M = 0.10, 1.80
SAMPLE_M = 0.05
"""Longest edge of the triangles whose corners are looked up in the grid: less than a cell."""
MIN_IN_CELL_M2 = 8e-4
"""Surface above a cell that stands in the way: an eighth of the cell; less is a stray shred."""
MIN_REGION_M2 = 0.5
"""Free floor below which a region is the inside of a cupboard, and nobody stands there."""
NEIGHBOURS = np.ones((3, 3), dtype=np.bool_)
"""Cells that touch by an edge or a corner: paths go across both."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeFloor:
    """Cells of the floor on which a person may stand.

    Attributes:
        free: (rows, columns) bool; row is y, column is x.
        low_xy: (2,) world position of the corner of cell (0, 0), metres.
    """

    free: Mask
    low_xy: Array

    def centres(self) -> Array:
        """(cells, 2) world positions of all cell centres, row by row."""
        rows, columns = self.free.shape
        across: Array = np.arange(columns, dtype=np.float64) + 0.5
        along: Array = np.arange(rows, dtype=np.float64) + 0.5
        cells = np.stack([np.tile(across, rows), np.repeat(along, columns)], axis=1)
        return self.low_xy + CELL_M * cells

    def nearest_free(self, point: Array) -> Array:
        """(2,) centre of the free cell nearest to a point; the point itself if all is blocked."""
        centres = self.centres()[self.free.ravel()]
        if len(centres) == 0:
            return point
        return centres[int(np.argmin(np.linalg.norm(centres - point, axis=1)))]

    def is_clear(self, a: Array, b: Array) -> bool:
        """Whether the straight way from `a` to `b` stays on free floor."""
        count = max(2, int(np.linalg.norm(b - a) / (0.5 * CELL_M)))
        points = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
        cells = np.floor((points - self.low_xy) / CELL_M).astype(int)
        cells = np.clip(cells, 0, np.array(self.free.shape[::-1]) - 1)
        return bool(self.free[cells[:, 1], cells[:, 0]].all())

    def cell(self, point: Array) -> tuple[int, int]:
        """(row, column) of a point, the nearest one outside the floor."""
        column, row = np.floor((point - self.low_xy) / CELL_M).astype(int)
        rows, columns = self.free.shape
        return int(np.clip(row, 0, rows - 1)), int(np.clip(column, 0, columns - 1))

    def reachable(self, point: Array) -> FreeFloor:
        """The free floor that can be walked to from the free cell nearest to a point."""
        labels, _ = _NDIMAGE.label(self.free, structure=NEIGHBOURS)
        label = labels[self.cell(self.nearest_free(point))]
        return FreeFloor((labels == label) & self.free, self.low_xy)


class FloorMap:
    """The floor of a room without its movable objects.

    Args:
        room: for the footprint, and the solids or the scanned mesh.
    """

    def __init__(self, room: PhysicalRoom) -> None:
        low = np.asarray(room.footprint_m[0], dtype=np.float64)
        columns, rows = np.maximum(1, np.ceil((room.footprint_m[1] - low) / CELL_M).astype(int))
        empty = FreeFloor(np.ones((rows, columns), np.bool_), low)
        self._centres = empty.centres()
        gap = _gap_to_solids(room, self._centres).reshape(rows, columns)
        if room.collision is not None:
            in_the_way = _in_the_way(room, empty)
            # Between centres of cells; half a cell of each is the other's.
            distance = CELL_M * _NDIMAGE.distance_transform_edt(~in_the_way) - 0.5 * CELL_M
            gap = np.minimum(gap, distance)
        self.solid: Mask = gap <= 0.0
        """(rows, columns) where something stands that never moves."""
        free = gap > BODY_RADIUS_M
        self.bare = FreeFloor(free if room.collision is None else _rooms_only(free), low)
        """The free floor if no movable object were there."""

    def around(self, obstacles: Sequence[tuple[Array, float]]) -> FreeFloor:
        """Floor that is neither near a solid nor near an obstacle: (x, y) and radius, metres."""
        free = self.bare.free.ravel().copy()
        for position, radius in obstacles:
            distance = np.linalg.norm(self._centres - position, axis=1)
            free &= distance > radius + OBJECT_MARGIN_M
        return FreeFloor(free.reshape(self.bare.free.shape), self.bare.low_xy)

    def is_solid(self, point: Array) -> bool:
        """Whether a place (2,) lies in what never moves."""
        return bool(self.solid[self.bare.cell(point)])


def _gap_to_solids(room: PhysicalRoom, centres: Array) -> Array:
    """(cells,) distance from each centre to the nearest solid that is in a person's way."""
    gap = np.full(len(centres), np.inf)
    for solid in room.solids:
        bottom = solid.object_from_box.translation[2] - solid.half_size_m[2]
        top = solid.object_from_box.translation[2] + solid.half_size_m[2]
        if bottom > HIGH_M or top < LOW_M:
            continue
        points = np.hstack([centres, np.full((len(centres), 1), 0.5 * (bottom + top))])
        local = solid.object_from_box.inverse() @ points
        outside = np.maximum(np.abs(local[:, :2]) - np.asarray(solid.half_size_m[:2]), 0.0)
        gap = np.minimum(gap, np.linalg.norm(outside, axis=1))
    return gap


def _in_the_way(room: PhysicalRoom, floor: FreeFloor) -> Mask:
    """(rows, columns) over which the scanned mesh has a surface between ankles and head.

    Where the mesh has no floor, the floor is taken to be there.
    """
    assert room.collision is not None
    pieces = without_objects(triangles_of(room.collision), room.objects)
    rows, columns = floor.free.shape
    low = np.array([*floor.low_xy, LOW_M])
    high = np.array([*(floor.low_xy + CELL_M * np.array([columns, rows])), HIGH_M])
    area = np.zeros((rows, columns))
    while len(pieces):
        inside = ((pieces.max(axis=1) >= low) & (pieces.min(axis=1) <= high)).all(axis=1)
        pieces = pieces[inside]
        edges = np.linalg.norm(np.roll(pieces, -1, axis=1) - pieces, axis=2)
        is_small = edges.max(axis=1, initial=0.0) < SAMPLE_M
        small = pieces[is_small]
        middle = small.mean(axis=1)
        kept = ((middle >= low) & (middle < high)).all(axis=1)
        cells = np.floor((middle[kept, :2] - floor.low_xy) / CELL_M).astype(int)
        size = np.linalg.norm(area_vectors(small[kept]), axis=1)
        np.add.at(area, (cells[:, 1], cells[:, 0]), size)
        pieces = _halve(pieces[~is_small], np.argmax(edges[~is_small], axis=1))
    return area > MIN_IN_CELL_M2


def _halve(triangles: Array, edge: NDArray[np.intp]) -> Array:
    """Triangles (T, 3, 3), each cut in two in the middle of an edge (T,)."""
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (edge + k) % 3] for k in range(3))
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])


def _rooms_only(free: Mask) -> Mask:
    """Without regions that are too small to be a room's floor."""
    labels, count = _NDIMAGE.label(free, structure=NEIGHBOURS)
    sizes = np.bincount(labels.ravel(), minlength=count + 1) * CELL_M**2
    return free & (sizes >= MIN_REGION_M2)[labels]
