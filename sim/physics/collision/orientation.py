"""Triangles whose free side a scan got wrong, turned round."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import sparse  # pyright: ignore[reportMissingTypeStubs]
from scipy.sparse import csgraph  # pyright: ignore[reportMissingTypeStubs]

from sim.physics.collision.grid import Array, area_vectors

_SPARSE: Any = cast(Any, sparse)
_CSGRAPH: Any = cast(Any, csgraph)
"""SciPy has no types; its graphs find pieces."""

LEVEL = 0.9
"""Cosine to up above which a triangle is level: within 26 degrees."""
LOWEST_M = 0.3
"""Height above the lowest level surface within which level surfaces are the floor's."""
TURNED_SHARE = 0.8
"""Share of the floor that has to look down before the whole mesh is taken to be inside out."""
SAME_M = 1e-5
"""Distance within which two corners are one."""


def turn_to_free_side(triangles: Array) -> Array:
    """Triangles (T, 3, 3), counter-clockwise seen from the free side where that can be known.

    Neighbours across an edge look the same way, as most of their piece does; a mesh whose floor
    looks down is inside out. Degenerate triangles are left out.
    """
    triangles = triangles[np.linalg.norm(area_vectors(triangles), axis=1) > 0.0]
    if not len(triangles):
        return triangles
    turned = _unlike_their_piece(triangles)
    result = np.where(turned[:, None, None], triangles[:, ::-1], triangles)
    return np.ascontiguousarray(result[:, ::-1]) if _is_inside_out(result) else result


def piece_areas_m2(triangles: Array) -> Array:
    """(T,) area of the piece that each triangle (T, 3, 3) hangs on by a corner, m²."""
    if not len(triangles):
        return np.zeros(0)
    corner = _corners(triangles)
    count = int(corner.max()) + 1
    ones = np.ones(2 * len(corner))
    ends = (np.repeat(corner[:, 0], 2), corner[:, 1:].ravel())
    graph = _SPARSE.coo_matrix((ones, ends), shape=(count, count))
    pieces, labels = _components(graph)
    piece = labels[corner[:, 0]]
    area = np.linalg.norm(area_vectors(triangles), axis=1)
    return np.asarray(np.bincount(piece, weights=area, minlength=pieces)[piece], dtype=np.float64)


def _components(graph: Any) -> tuple[int, NDArray[np.int64]]:
    """How many pieces a graph has, and the piece of each of its nodes."""
    pieces, labels = _CSGRAPH.connected_components(graph, directed=False)
    return int(pieces), np.asarray(labels, dtype=np.int64)


def _corners(triangles: Array) -> NDArray[np.int64]:
    """(T, 3) numbers of the corners, those in one place the same."""
    keys = np.round(triangles.reshape(-1, 3) / SAME_M).astype(np.int64)
    _, corner = np.unique(keys, axis=0, return_inverse=True)
    return np.asarray(corner.reshape(-1, 3), dtype=np.int64)


def _unlike_their_piece(triangles: Array) -> NDArray[np.bool_]:
    """(T,) which look the other way than the larger part of the piece that they hang on."""
    count = len(triangles)
    corner = _corners(triangles)
    start, end = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    owner = np.repeat(np.arange(count), 3)
    number = int(corner.max()) + 1
    edge = np.minimum(start, end) * number + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    edge, owner, forward = edge[order], owner[order], (start < end)[order]
    _, first, size = np.unique(edge, return_index=True, return_counts=True)
    # Where three meet, as at a shelf's board, neither is the other's neighbour.
    pair = first[size == 2]
    a, b, is_like = owner[pair], owner[pair + 1], forward[pair] != forward[pair + 1]
    # A node for each triangle as it is, and one for it turned round.
    rows = np.concatenate([a, a + count])
    columns = np.concatenate([np.where(is_like, b, b + count), np.where(is_like, b + count, b)])
    graph = _SPARSE.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(2 * count, 2 * count))
    pieces, label = _components(graph)
    area = np.linalg.norm(area_vectors(triangles), axis=1)
    as_is, turned = label[:count], label[count:]
    kept = np.bincount(as_is, weights=area, minlength=pieces)
    # On a one-sided surface both are one, and nothing is turned.
    return kept[turned] > kept[as_is]


def _is_inside_out(triangles: Array) -> bool:
    vectors = area_vectors(triangles)
    area = np.linalg.norm(vectors, axis=1)
    is_level = np.abs(vectors[:, 2]) > LEVEL * area
    if not is_level.any():
        return False
    height = triangles[:, :, 2].mean(axis=1)
    order = np.argsort(height[is_level], kind="stable")
    reached = np.cumsum(area[is_level][order])
    # A few shreds below the floor are no floor.
    lowest = height[is_level][order][np.searchsorted(reached, 0.02 * reached[-1])]
    is_floor = is_level & (np.abs(height - lowest) < LOWEST_M)
    down = float(area[is_floor & (vectors[:, 2] < 0.0)].sum())
    return down > TURNED_SHARE * float(area[is_floor].sum())
