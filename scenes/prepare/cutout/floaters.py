"""Stray splats that hang in the room, and their removal as a cut that can be undone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from scenes.cut import divide
from scenes.package import ScenePackage
from scenes.package_records import Stage
from scenes.pose import rotation_from_quaternion
from scenes.prepare.cutout.bodies import bodies
from scenes.prepare.cutout.cutout import FLOATERS
from scenes.splats import SplatCloud

REACH_M = 0.12
"""Splats of a surface are closer to each other than this, plus their own size."""
FAINT = 0.05
"""Splats of less opacity hold no others together."""
LEAST_AREA_M2 = 0.004
"""What hangs together with less opaque surface than this, away from all else, is no thing."""


def find_floaters(cloud: SplatCloud) -> NDArray[np.bool_]:
    """(N,) True for splats of bodies too small to be anything; metres.

    A body is what hangs together in a grid of cells, where a splat fills the cells that its larger
    axes reach (as the filters of splat editors do, with surface instead of a count).
    """
    if not len(cloud):
        return np.zeros(0, dtype=bool)
    ends, owner = _reaching(cloud)
    count, body_of_end = bodies(ends, REACH_M)
    # A splat's ends are one splat: bodies that share one are the same.
    body = _joined(body_of_end, owner, count, len(cloud))
    sizes = np.sort(cloud.scales.astype(np.float64), axis=1)[:, 1:]
    area = np.pi * sizes.prod(axis=1) * cloud.opacities
    total = np.bincount(body, weights=area, minlength=int(body.max()) + 1)
    return total[body] < LEAST_AREA_M2


def remove_floaters(package: ScenePackage) -> tuple[ScenePackage, int]:
    """The package without the room's stray splats, and how many they were.

    `scenes.prepare.cutout.cutout.undo_cut` puts them back.
    """
    stray = find_floaters(package.room)
    if not stray.any():
        return package, 0
    room, cut = divide(package.room, np.zeros_like(stray), object_id="", floaters=stray)
    stage = Stage(f"cut {FLOATERS}", f"{len(cut.taken)} stray splats removed")
    changed = replace(
        package, room=room, cuts=(*package.cuts, cut), stages=(*package.stages, stage)
    )
    return changed, len(cut.taken)


def _reaching(cloud: SplatCloud) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Centres, and for large splats the ends of their axes; and whose they are."""
    means = cloud.means.astype(np.float64)
    solid = np.flatnonzero((cloud.scales.max(axis=1) > REACH_M / 4) & (cloud.opacities >= FAINT))
    axes = rotation_from_quaternion(cloud.rotations[solid]) * cloud.scales[solid][:, None, :]
    points, owners = [means], [np.arange(len(means))]
    for axis in range(3):
        for step in (-2.0, -1.0, 1.0, 2.0):
            points.append(means[solid] + step * axes[:, :, axis])
            owners.append(solid)
    return np.concatenate(points), np.concatenate(owners)


def _joined(
    body_of_end: NDArray[np.intp], owner: NDArray[np.intp], count: int, splats: int
) -> NDArray[np.intp]:
    """(N,) the body of each splat when bodies that share a splat are one."""
    own = body_of_end[:splats]
    graph = csr_array((np.ones(len(owner)), (own[owner], body_of_end)), shape=(count, count))
    _, merged = connected_components(graph, directed=False)
    return np.asarray(merged, dtype=np.intp)[own]
