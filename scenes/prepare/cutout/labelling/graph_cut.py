# pyright: standard
"""The cheapest division of splats into object and rest, by votes and by who lies beside whom."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow
from scipy.spatial import KDTree

Links = tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]
"""Pairs of splats beside each other, every pair once: (first, second, strength 0..1)."""

NEIGHBOURS = 10
"""Neighbours that a splat is linked with."""
COLOUR_TOLERANCE = 0.12
"""Colour difference (0..1 per channel, Euclidean) at which two neighbours hold half as fast."""
UNITS = 1000
"""Maximum flow counts in whole numbers: one unit of cost is this many."""


def neighbour_links(positions: NDArray[np.floating], colours: NDArray[np.floating]) -> Links:
    """Links between splats that lie beside each other.

    A link holds by nearness, in units of the distance to the farther neighbours, and by likeness of
    colour.
    """
    count = min(NEIGHBOURS + 1, len(positions))
    distances, others = KDTree(positions).query(positions, k=count, workers=-1)
    distances, others = np.atleast_2d(distances)[:, 1:], np.atleast_2d(others)[:, 1:]
    first = np.repeat(np.arange(len(positions)), count - 1)
    second = others.ravel()
    reach = np.maximum(distances[:, -1:] if count > 1 else distances, 1e-9)
    nearness = np.exp(-((distances / reach) ** 2)).ravel()
    apart = np.linalg.norm(colours[first] - colours[second], axis=1)
    strength = nearness * np.exp(-((apart / COLOUR_TOLERANCE) ** 2) * np.log(2.0))
    low, high = np.minimum(first, second), np.maximum(first, second)
    _, once = np.unique(low * len(positions) + high, return_index=True)
    return low[once], high[once], strength[once]


def cut(
    belief: NDArray[np.floating],
    links: Links,
    *,
    smoothness: float,
) -> NDArray[np.bool_]:
    """The labels of least cost (Boykov and Jolly 2001): (N,) True for the object.

    Args:
        belief: (N,) cost of calling a splat the rest minus that of calling it the object: positive
            where it should be the object; infinite where it must be.
        links: as `neighbour_links` gives them.
        smoothness: cost of separating two splats whose link has strength 1.
    """
    n = len(belief)
    source, sink = n, n + 1
    first, second, strength = links
    most = np.iinfo(np.int32).max // 4
    cost = np.minimum(np.abs(belief) * UNITS, most).astype(np.int32)
    for_object, against = np.flatnonzero(belief > 0), np.flatnonzero(belief < 0)
    held = np.minimum(smoothness * strength * UNITS, most).astype(np.int32)
    rows = np.concatenate([np.full(len(for_object), source), against, first, second])
    columns = np.concatenate([for_object, np.full(len(against), sink), second, first])
    values = np.concatenate([cost[for_object], cost[against], held, held])
    graph = csr_array((values, (rows, columns)), shape=(n + 2, n + 2), dtype=np.int32)
    flow = maximum_flow(graph, source, sink).flow
    left_over = csr_array(graph - flow)
    left_over.data = np.where(left_over.data > 0, left_over.data, 0)
    left_over.eliminate_zeros()
    reached = breadth_first_order(left_over, source, return_predecessors=False)
    labels = np.zeros(n + 2, dtype=bool)
    labels[reached] = True
    return labels[:n]
