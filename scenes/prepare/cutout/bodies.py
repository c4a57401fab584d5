"""Which points hang together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree


def bodies(positions: NDArray[np.floating], reach_m: float) -> tuple[int, NDArray[np.intp]]:
    """The connected bodies of points: how many, and (N,) which one each point belongs to.

    Points hang together if their cells touch; cells are half of `reach_m` wide, so that gaps up to
    half of `reach_m` never part a body and gaps above twice of it always do.
    """
    cells = np.floor(np.asarray(positions, dtype=np.float64) / (0.5 * reach_m)).astype(np.int64)
    places, cell_of = np.unique(cells, axis=0, return_inverse=True)
    pairs = KDTree(places).query_pairs(1.8, output_type="ndarray")
    n = len(places)
    graph = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, body = connected_components(graph, directed=False)
    return int(count), body[cell_of.ravel()].astype(np.intp)
