"""Tilt and thickness of patches, by those around them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import spatial  # pyright: ignore[reportMissingTypeStubs]

from sim.physics.collision.patches import CELL_M, DEPTH_M, Patches

_KDTree: Any = cast(Any, spatial).KDTree
"""SciPy has no types; its trees find neighbours."""

MIN_DEPTH_M = 0.006
"""Thickness of a sheet that was scanned from both sides."""
SAME_SURFACE = 0.966
"""Cosine between the normals of neighbours of one surface: 15 degrees."""
SAME_SURFACE_M = 0.015
"""How far a neighbour of the same surface lies from a patch's plane."""
SEAM_M = 0.02
"""How far a patch goes on into its neighbour: more than anything enters a face."""
BACK_GAP_M = 0.003
"""How far before the back's face a body ends: neither noise nor a slant makes it stick out."""
OPPOSITE = -0.8
"""Cosine between two normals below which one surface is the back of the other."""
SIZE_SHARES = np.array([0.1, 0.2, 0.4])
"""Half diagonals between patches of a size, in cells: neighbours of small ones are near."""
END_SHARE = 0.3
"""Share of a patch below which what touches it from behind is the end of another solid."""
OVERLAP_M = 0.002
"""How far two patches have to cover each other, seen along the normal, to be front and back."""


def with_depths(patches: Patches, others: Patches) -> Patches:
    """The patches, no thicker than to the surface behind them that looks the other way.

    Args:
        patches: to be given their thickness.
        others: all surfaces there are, `patches` included.
    """
    depth = np.full(len(patches), DEPTH_M)
    if len(patches) and len(others):
        mine, theirs = _near(patches, others)
        cosine = np.einsum("nk,nk->n", patches.normal[mine], others.normal[theirs])
        is_back = cosine < OPPOSITE
        mine, theirs = mine[is_back], theirs[is_back]
        to_other = others.centre[theirs] - patches.centre[mine]
        local = np.einsum("nka,nk->na", patches.world_from_patch[mine, :, :2], to_other)
        local = np.clip(local, -patches.half_m[mine], patches.half_m[mine])
        to_other -= np.einsum("nka,na->nk", patches.world_from_patch[mine, :, :2], local)
        behind = -np.einsum("nk,nk->n", others.normal[theirs], to_other) / cosine[is_back]
        # A board's end in the middle of a panel is no back of the panel.
        is_end = others.area_m2[theirs] < END_SHARE * patches.area_m2[mine]
        is_near = ~(is_end & (np.abs(behind) < MIN_DEPTH_M))
        is_near &= (behind > -MIN_DEPTH_M) & (behind < DEPTH_M + BACK_GAP_M)
        mine, theirs = mine[is_near], theirs[is_near]
        to_other = others.centre[theirs] - patches.centre[mine]
        behind = behind[is_near]
        is_over = np.ones(len(mine), dtype=np.bool_)
        for axis in range(2):
            along = patches.world_from_patch[mine, :, axis]
            reach = np.abs(np.einsum("nk,nka->na", along, others.world_from_patch[theirs, :, :2]))
            half = patches.half_m[mine, axis] + np.sum(reach * others.half_m[theirs], axis=1)
            is_over &= np.abs(np.einsum("nk,nk->n", along, to_other)) < half - OVERLAP_M
        thickness = np.clip(behind - BACK_GAP_M, MIN_DEPTH_M, DEPTH_M)
        np.minimum.at(depth, mine[is_over], thickness[is_over])
    return Patches(patches.centre, patches.world_from_patch, patches.half_m, depth, patches.cell)


def smooth(patches: Patches, others: Patches) -> Patches:
    """The patches, turned about their centres as the surface around them runs, seams covered.

    A patch of a few noisy triangles is tilted by some degrees; a table's top is not.

    Args:
        patches: to be turned.
        others: all surfaces there are; `patches` are among them.
    """
    if not len(patches):
        return patches
    mine, theirs = _near(patches, others)
    to_other = others.centre[theirs] - patches.centre[mine]
    cosine = np.einsum("nk,nk->n", patches.normal[mine], others.normal[theirs])
    height = np.einsum("nk,nk->n", patches.normal[mine], to_other)
    is_same = (cosine > SAME_SURFACE) & (np.abs(height) < SAME_SURFACE_M)
    mine, theirs = mine[is_same], theirs[is_same]
    weighted = others.normal[theirs] * others.area_m2[theirs, None]
    normal = np.column_stack(
        [np.bincount(mine, weights=column, minlength=len(patches)) for column in weighted.T]
    )
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    first = patches.world_from_patch[:, :, 0]
    first = first - normal * np.einsum("nk,nk->n", first, normal)[:, None]
    first /= np.linalg.norm(first, axis=1)[:, None]
    rotation = np.stack([first, np.cross(normal, first), normal], axis=2)
    turned = Patches(patches.centre, rotation, patches.half_m, patches.depth_m, patches.cell)
    return _over_seams(turned, others, mine, theirs)


def _over_seams(
    patches: Patches, others: Patches, mine: NDArray[np.int64], theirs: NDArray[np.int64]
) -> Patches:
    """The patches, a little larger on the sides where a neighbour of the same surface goes on.

    A corner that enters at a seam is then nearer to the faces than to any side, so it is pushed
    out and not wedged in.

    Args:
        patches: to be made larger.
        others: their neighbours.
        mine: (P,) a patch of each pair of one surface.
        theirs: (P,) its neighbour.
    """
    to_other = others.centre[theirs] - patches.centre[mine]
    local = np.einsum("nka,nk->na", patches.world_from_patch[mine, :, :2], to_other)
    share = np.einsum(
        "nka,nkb->nab",
        patches.world_from_patch[mine, :, :2],
        others.world_from_patch[theirs, :, :2],
    )
    reach = np.einsum("nab,nb->na", np.abs(share), others.half_m[theirs])
    half = patches.half_m[mine]
    more = np.zeros((len(patches), 2, 2))
    for axis in range(2):
        other = 1 - axis
        is_along = np.abs(local[:, other]) + half[:, other] < reach[:, other] + SEAM_M
        gap = np.abs(local[:, axis]) - half[:, axis] - reach[:, axis]
        goes_on = is_along & (np.abs(gap) < SEAM_M) & (np.abs(local[:, axis]) > half[:, axis])
        for side, sign in enumerate((-1.0, 1.0)):
            which = mine[goes_on & (np.sign(local[:, axis]) == sign)]
            more[which, axis, side] = SEAM_M
    centre = patches.centre + np.einsum(
        "nka,na->nk", patches.world_from_patch[:, :, :2], 0.5 * (more[:, :, 1] - more[:, :, 0])
    )
    larger = patches.half_m + 0.5 * more.sum(axis=2)
    return Patches(centre, patches.world_from_patch, larger, patches.depth_m, patches.cell)


def _near(patches: Patches, others: Patches) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs (patch, other) that may be front and back."""
    pairs: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    for mine, mine_m in _by_size(patches):
        tree = _KDTree(patches.centre[mine])
        for theirs, theirs_m in _by_size(others):
            reach_m = mine_m + theirs_m + DEPTH_M
            found = tree.sparse_distance_matrix(
                _KDTree(others.centre[theirs]), reach_m, output_type="ndarray"
            )
            pairs.append((mine[found["i"]], theirs[found["j"]]))
    return np.concatenate([a for a, _ in pairs]), np.concatenate([b for _, b in pairs])


def _by_size(patches: Patches) -> list[tuple[NDArray[np.int64], float]]:
    """Indices of patches of like size, each with the half diagonal of the largest, metres."""
    radius = np.linalg.norm(patches.half_m, axis=1)
    limits = [0.0, *(SIZE_SHARES * CELL_M), np.inf]
    classes = [np.flatnonzero((radius > low) & (radius <= high)) for low, high in pairwise(limits)]
    return [(which, float(radius[which].max())) for which in classes if len(which)]
