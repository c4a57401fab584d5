"""Stray splats that hang in the room, and their removal as a cut that can be undone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.cut import divide
from scenes.package import ScenePackage
from scenes.package.records import Stage
from scenes.prepare.cutout.connected_bodies import bodies_of_splats
from scenes.splats import SplatCloud

FLOATERS = "floaters"
"""Name of the stage of a cut without an object."""
REACH_M = 0.12
"""Splats of a surface are closer to each other than this, plus their own size."""
MIN_AREA_M2 = 0.004
"""Opaque surface below which a connected body, away from all else, is no object."""


def find_floaters(cloud: SplatCloud) -> NDArray[np.bool_]:
    """(N,) True for splats of bodies too small to be anything; metres.

    A body is what hangs together in a grid of cells, where a splat fills the cells that its larger
    axes reach (as the filters of splat editors do, with surface instead of a count).
    """
    if not len(cloud):
        return np.zeros(0, dtype=bool)
    count, body = bodies_of_splats(cloud, REACH_M)
    sizes = np.sort(cloud.scales.astype(np.float64), axis=1)[:, 1:]
    area = np.pi * sizes.prod(axis=1) * cloud.opacities
    total = np.bincount(body, weights=area, minlength=count)
    return total[body] < MIN_AREA_M2


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
