# pyright: standard
"""Cells of space that many points lie in, and which points are near others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

MAX_CELLS = 2**62
"""Cells of the box around all points that a number can count; more are distinguished by rows."""


def cells_of(
    points: NDArray[np.floating], side: float
) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """The cells of a grid that hold points, and each point's.

    Args:
        points: (N, 3).
        side: of a cell, in the points' unit.

    Returns:
        (K, 3) cells in the order of their coordinates, and (N,) the number of each point's cell.
    """
    cells = np.floor(np.asarray(points, dtype=np.float64) / side).astype(np.int64).reshape(-1, 3)
    if not len(cells):
        return cells, np.zeros(0, dtype=np.intp)
    low = cells.min(axis=0)
    across = [int(count) for count in cells.max(axis=0) - low + 1]
    if across[0] * across[1] * across[2] > MAX_CELLS:
        places, cell = np.unique(cells, axis=0, return_inverse=True)
        return places, cell.ravel()
    x, y, z = (cells - low).T
    code, cell = np.unique((x * across[1] + y) * across[2] + z, return_inverse=True)
    rows, z = np.divmod(code, across[2])
    return low + np.stack([*np.divmod(rows, across[1]), z], axis=1), cell


def nearest(
    places: NDArray[np.floating], among: NDArray[np.floating], *, count: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Distances (N, K) to the nearest of some points, and which ones, the nearest first.

    Args:
        places: (N, D).
        among: (M, D), at least one.
        count: K; fewer where there are not so many points.
    """
    shape = len(places), min(count, len(among))
    apart, which = KDTree(among).query(places, k=shape[1], workers=-1)
    return np.reshape(apart, shape), np.reshape(which, shape).astype(np.intp)


def pairs_within(
    points: NDArray[np.floating], reach: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and second (P,) of every pair of points (N, D) that are not farther apart."""
    pairs = KDTree(points).query_pairs(reach, output_type="ndarray")
    return pairs[:, 0].astype(np.intp), pairs[:, 1].astype(np.intp)
