"""Objects that stand where a surface has appeared, and how they get out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.physics.collision.grid import Array
from sim.physics.collision.patches import Patches
from sim.physics.engine import mujoco

ONE_WAY = 0.7
"""Cosine within which patches push the same way: 45 degrees."""

FROM_BEHIND_M = 0.02
"""How far something may reach in from behind and still belong there: a table's top lies on the
body of its underside."""


@dataclass(frozen=True, slots=True, eq=False)
class WayOut:
    """How objects get out of patches that have appeared where they stand.

    Attributes:
        lowered_m: (N,) how far behind its place each patch begins, to push its objects from there.
        is_waiting: (N,) which have to wait until the objects are out, because they would push them
            back in.
    """

    lowered_m: Array
    is_waiting: NDArray[np.bool_]


def way_out(
    patches: Patches, model: Any, data: Any, geoms: NDArray[np.int64], *, tolerated_m: float
) -> WayOut:
    """Per object the shortest way out of the patches it stands in.

    Args:
        patches: that have appeared.
        model: of the objects.
        data: where they are.
        geoms: of the objects.
        tolerated_m: overlap that does not matter.
    """
    lowered, is_waiting = np.zeros(len(patches)), np.zeros(len(patches), dtype=np.bool_)
    if not len(patches) or not len(geoms):
        return WayOut(lowered, is_waiting)
    depths, backs = depths_in_patches(patches, model, data, geoms)
    depths = np.where(backs > tolerated_m, depths, 0.0)
    bodies = model.geom_bodyid[geoms]
    for body in np.unique(bodies[(depths > tolerated_m).any(axis=0)]).tolist():
        depth = depths[:, bodies == body].max(axis=1)
        back = backs[:, bodies == body].max(axis=1)
        inside = np.flatnonzero(depth > tolerated_m)
        same_way = patches.normal[inside] @ patches.normal[inside].T > ONE_WAY
        needed = np.where(same_way, depth[inside], 0.0).max(axis=1)
        # What reaches in from behind is nearer to the back's way out.
        from_behind = back[inside] < np.minimum(depth[inside], FROM_BEHIND_M)
        if from_behind.all():
            is_waiting[inside] = True
            continue
        needed[from_behind] = np.inf
        same_way &= ~from_behind[None]
        chosen = same_way[np.argmin(needed)]
        pushing = inside[chosen]
        lowered[pushing] = np.maximum(lowered[pushing], depth[pushing])
        is_waiting[inside[~chosen]] = True
    return WayOut(lowered, is_waiting)


def depths_in_patches(
    patches: Patches, model: Any, data: Any, geoms: NDArray[np.int64]
) -> tuple[Array, Array]:
    """(N, G) how far geoms reach into patches from their faces, and from their backs; 0 outside.

    A geom counts by the box around it. Metres.
    """
    half = half_sizes(model, geoms)
    patch_from_world = patches.world_from_patch.transpose(0, 2, 1)
    to_geom = data.geom_xpos[geoms][None] - patches.centre[:, None]
    local = np.einsum("nab,ngb->nga", patch_from_world, to_geom)
    rotation = data.geom_xmat[geoms].reshape(-1, 3, 3)
    turned = np.einsum("nab,gbc->ngac", patch_from_world, rotation)
    reach = np.einsum("ngac,gc->nga", np.abs(turned), half)
    beside = (np.abs(local[:, :, :2]) < reach[:, :, :2] + patches.half_m[:, None]).all(axis=2)
    lowest, highest = local[:, :, 2] - reach[:, :, 2], local[:, :, 2] + reach[:, :, 2]
    is_in = beside & (lowest < 0.0) & (highest > -patches.depth_m[:, None])
    from_back = highest + patches.depth_m[:, None]
    return np.where(is_in, -lowest, 0.0), np.where(is_in, from_back, 0.0)


def half_sizes(model: Any, geoms: NDArray[np.int64]) -> Array:
    """(G, 3) half sides of the boxes around geoms, in their own frames, metres."""
    size = np.array(model.geom_size[geoms], dtype=np.float64)
    kind = model.geom_type[geoms]
    is_sphere = kind == int(mujoco.mjtGeom.mjGEOM_SPHERE)
    is_cylinder = kind == int(mujoco.mjtGeom.mjGEOM_CYLINDER)
    size[is_cylinder] = size[is_cylinder][:, [0, 0, 1]]
    size[is_sphere] = size[is_sphere][:, [0, 0, 0]]
    return size
