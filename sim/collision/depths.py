# pyright: standard
"""How thick patches are: thin things are scanned from both sides."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sim.collision.patches import CELL_M, DEPTH_M, Patches

LEAST_DEPTH_M = 0.006
"""Thickness of a sheet that was scanned from both sides."""
BACK_GAP_M = 0.003
"""How far before the back's face a body ends: neither noise nor a slant makes it stick out."""
OPPOSITE = -0.3
"""Cosine between two normals below which one surface is the back of the other."""
SIZE_SHARES = np.array([0.1, 0.2, 0.4])
"""Half diagonals between patches of a size, in cells: neighbours of small ones are near."""
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
        is_back = np.einsum("nk,nk->n", patches.normal[mine], others.normal[theirs]) < OPPOSITE
        mine, theirs = mine[is_back], theirs[is_back]
        to_other = others.centre[theirs] - patches.centre[mine]
        behind = -np.einsum("nk,nk->n", patches.normal[mine], to_other)
        is_near = (behind > -LEAST_DEPTH_M) & (behind < DEPTH_M + BACK_GAP_M)
        mine, theirs = mine[is_near], theirs[is_near]
        to_other, behind = to_other[is_near], behind[is_near]
        is_over = np.ones(len(mine), dtype=np.bool_)
        for axis in range(2):
            along = patches.world_from_patch[mine, :, axis]
            reach = np.abs(np.einsum("nk,nka->na", along, others.world_from_patch[theirs, :, :2]))
            half = patches.half_m[mine, axis] + np.sum(reach * others.half_m[theirs], axis=1)
            is_over &= np.abs(np.einsum("nk,nk->n", along, to_other)) < half - OVERLAP_M
        thickness = np.clip(behind - BACK_GAP_M, LEAST_DEPTH_M, DEPTH_M)
        np.minimum.at(depth, mine[is_over], thickness[is_over])
    return Patches(patches.centre, patches.world_from_patch, patches.half_m, depth, patches.cell)


def _near(patches: Patches, others: Patches) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs (patch, other) that may be front and back."""
    pairs: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    for mine, mine_m in _by_size(patches):
        tree = cKDTree(patches.centre[mine])
        for theirs, theirs_m in _by_size(others):
            reach_m = mine_m + theirs_m + DEPTH_M
            found = tree.sparse_distance_matrix(
                cKDTree(others.centre[theirs]), reach_m, output_type="ndarray"
            )
            pairs.append((mine[found["i"]], theirs[found["j"]]))
    return np.concatenate([a for a, _ in pairs]), np.concatenate([b for _, b in pairs])


def _by_size(patches: Patches) -> list[tuple[NDArray[np.int64], float]]:
    """Indices of patches of like size, each with the half diagonal of the largest, metres."""
    radius = np.linalg.norm(patches.half_m, axis=1)
    limits = [0.0, *(SIZE_SHARES * CELL_M), np.inf]
    classes = [np.flatnonzero((radius > low) & (radius <= high)) for low, high in pairwise(limits)]
    return [(which, float(radius[which].max())) for which in classes if len(which)]
