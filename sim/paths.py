# pyright: standard
"""Ways on foot around furniture: a shortest path on a grid of free floor, then pulled straight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from scenes.mesh import PhysicalRoom

CELL_M = 0.08
BODY_RADIUS_M = 0.24
OBJECT_MARGIN_M = 0.20
LOW_M, HIGH_M = 0.10, 1.80
NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))


@dataclass(frozen=True, slots=True, eq=False)
class FreeFloor:
    """Where a person may stand.

    Attributes:
        free: (rows, columns) bool; row is y, column is x.
        low_xy: (2,) world position of the corner of cell (0, 0), metres.
    """

    free: NDArray[np.bool_]
    low_xy: NDArray[np.float64]

    def centres(self) -> NDArray[np.float64]:
        """(cells, 2) world positions of all cell centres, row by row."""
        rows, columns = self.free.shape
        x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
        return self.low_xy + CELL_M * np.stack([x.ravel(), y.ravel()], axis=1)

    def nearest_free(self, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """(2,) centre of the free cell nearest to a point; the point itself if all is blocked."""
        centres = self.centres()[self.free.ravel()]
        if len(centres) == 0:
            return point
        return centres[int(np.argmin(np.linalg.norm(centres - point, axis=1)))]

    def is_clear(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
        """Whether the straight way from `a` to `b` stays on free floor."""
        count = max(2, int(np.linalg.norm(b - a) / (0.5 * CELL_M)))
        points = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
        cells = np.floor((points - self.low_xy) / CELL_M).astype(int)
        cells = np.clip(cells, 0, np.array(self.free.shape[::-1]) - 1)
        return bool(self.free[cells[:, 1], cells[:, 0]].all())


def free_floor(
    room: PhysicalRoom, obstacles: Sequence[tuple[NDArray[np.float64], float]]
) -> FreeFloor:
    """Floor that is neither under a solid nor near an obstacle.

    Args:
        room: for the footprint and the solids.
        obstacles: (x, y) and radius of each obstacle on the floor, metres.
    """
    low = np.asarray(room.footprint_m[0], dtype=np.float64)
    columns, rows = np.maximum(1, np.ceil((room.footprint_m[1] - low) / CELL_M).astype(int))
    floor = FreeFloor(np.ones((rows, columns), np.bool_), low)
    centres = floor.centres()
    free = np.ones(len(centres), np.bool_)
    for solid in room.solids:
        bottom = solid.object_from_box.translation[2] - solid.half_size_m[2]
        top = solid.object_from_box.translation[2] + solid.half_size_m[2]
        if bottom > HIGH_M or top < LOW_M:
            continue
        points = np.hstack([centres, np.full((len(centres), 1), 0.5 * (bottom + top))])
        local = solid.object_from_box.inverse() @ points
        outside = np.maximum(np.abs(local[:, :2]) - np.asarray(solid.half_size_m[:2]), 0.0)
        free &= np.linalg.norm(outside, axis=1) > BODY_RADIUS_M
    for position, radius in obstacles:
        free &= np.linalg.norm(centres - position, axis=1) > radius + OBJECT_MARGIN_M
    return FreeFloor(free.reshape(rows, columns), low)


def walking_path(
    floor: FreeFloor, start: NDArray[np.float64], goal: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Corner points from `start` (left out) to `goal` (the last).

    The first and last stretch may cross blocked floor: a person may stand close to furniture.
    Where there is no way, the straight one is returned.
    """
    if floor.is_clear(start, goal):
        return [goal]
    rows, columns = floor.free.shape
    numbers = np.arange(rows * columns).reshape(rows, columns)
    first, second, cost = [], [], []
    for dx, dy in NEIGHBOURS:
        a = numbers[max(0, -dy) : rows - max(0, dy), : columns - dx]
        b = numbers[max(0, dy) : rows + min(0, dy), dx:]
        both = floor.free.ravel()[a] & floor.free.ravel()[b]
        first.append(a[both])
        second.append(b[both])
        cost.append(np.full(int(both.sum()), np.hypot(dx, dy)))
    graph = coo_matrix(
        (np.concatenate(cost), (np.concatenate(first), np.concatenate(second))),
        shape=(rows * columns, rows * columns),
    ).tocsr()
    centres = floor.centres()
    from_cell, to_cell = (_cell(floor, floor.nearest_free(p)) for p in (start, goal))
    _, before = dijkstra(graph, directed=False, indices=from_cell, return_predecessors=True)
    cells = [to_cell]
    while cells[-1] != from_cell:
        previous = int(before[cells[-1]])
        if previous < 0:
            return [goal]
        cells.append(previous)
    return _pulled_straight(floor, [start, *(centres[c] for c in reversed(cells)), goal])


def _pulled_straight(
    floor: FreeFloor, points: list[NDArray[np.float64]]
) -> list[NDArray[np.float64]]:
    kept = []
    here = 0
    while here < len(points) - 1:
        ahead = len(points) - 1
        while ahead > here + 1 and not floor.is_clear(points[here], points[ahead]):
            ahead -= 1
        kept.append(points[ahead])
        here = ahead
    return kept


def _cell(floor: FreeFloor, point: NDArray[np.float64]) -> int:
    column, row = np.floor((point - floor.low_xy) / CELL_M).astype(int)
    rows, columns = floor.free.shape
    return int(np.clip(row, 0, rows - 1) * columns + np.clip(column, 0, columns - 1))
