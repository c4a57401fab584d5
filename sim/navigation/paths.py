# pyright: standard
"""Ways on foot around furniture: a shortest path on a grid of free floor, then pulled straight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from scenes.mesh import PhysicalRoom
from sim.navigation.floor import FloorMap, FreeFloor

NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))


def free_floor(
    room: PhysicalRoom, obstacles: Sequence[tuple[NDArray[np.float64], float]]
) -> FreeFloor:
    """Floor that is neither near what stands still nor near an obstacle.

    Args:
        room: for the footprint, and the solids or the scanned mesh.
        obstacles: (x, y) and radius of each obstacle on the floor, metres.
    """
    return FloorMap(room).around(obstacles)


def has_way(floor: FreeFloor, start: NDArray[np.float64], goal: NDArray[np.float64]) -> bool:
    """Whether free floor near `start` and free floor near `goal` hang together."""
    if not floor.free.any():
        return False
    reachable = floor.reachable(start)
    return bool(reachable.free[floor.cell(floor.nearest_free(goal))])


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
    return _pull_straight(floor, [start, *(centres[c] for c in reversed(cells)), goal])


def _pull_straight(
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
    row, column = floor.cell(point)
    return row * floor.free.shape[1] + column
