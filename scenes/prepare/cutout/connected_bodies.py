# pyright: standard
"""Connected bodies of points and of splats."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from scenes.pose import rotation_from_quaternion
from scenes.prepare.cells import cells_of, pairs_within
from scenes.splats import SplatCloud

FAINT = 0.05
"""Splats of less opacity hold no others together."""


def bodies(positions: NDArray[np.floating], reach_m: float) -> tuple[int, NDArray[np.intp]]:
    """The connected bodies of points: how many, and (N,) which one each point belongs to.

    Points hang together if their cells touch; cells are half of `reach_m` wide, so that gaps up to
    half of `reach_m` never part a body and gaps above twice of it always do.
    """
    places, cell_of = cells_of(positions, 0.5 * reach_m)
    first, second = pairs_within(places.astype(np.float64), 1.8)
    count, body = linked(first, second, count=len(places))
    return count, body[cell_of]


def linked(
    first: NDArray[np.intp], second: NDArray[np.intp], *, count: int
) -> tuple[int, NDArray[np.intp]]:
    """How many bodies `count` points are that hang together by these links, and each one's."""
    graph = csr_array((np.ones(len(first)), (first, second)), shape=(count, count))
    left, body = connected_components(graph, directed=False)
    return int(left), np.asarray(body, dtype=np.intp)


def bodies_of_splats(cloud: SplatCloud, reach_m: float) -> tuple[int, NDArray[np.intp]]:
    """As `bodies`, for splats: one that is large hangs together with whatever its axes reach."""
    ends, owner = _reaching(cloud, reach_m)
    count, body_of_end = bodies(ends, reach_m)
    # A splat's ends are one splat: bodies that share one are the same.
    return _join(body_of_end, owner, count, len(cloud))


def _reaching(cloud: SplatCloud, reach_m: float) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Centres, and for large splats the ends of their axes; and whose they are."""
    means = cloud.means.astype(np.float64)
    solid = np.flatnonzero((cloud.scales.max(axis=1) > reach_m / 4) & (cloud.opacities >= FAINT))
    axes = rotation_from_quaternion(cloud.rotations[solid]) * cloud.scales[solid][:, None, :]
    points, owners = [means], [np.arange(len(means))]
    for axis in range(3):
        for step in (-2.0, -1.0, 1.0, 2.0):
            points.append(means[solid] + step * axes[:, :, axis])
            owners.append(solid)
    return np.concatenate(points), np.concatenate(owners)


def _join(
    body_of_end: NDArray[np.intp], owner: NDArray[np.intp], count: int, splats: int
) -> tuple[int, NDArray[np.intp]]:
    """How many bodies are left when those that share a splat are one, and (N,) each splat's."""
    own = body_of_end[:splats]
    left, merged = linked(own[owner], body_of_end, count=count)
    return left, merged[own]
