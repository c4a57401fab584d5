"""How many yaws of an object look the same, from its triangles and their colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from scenes.mesh import TexturedMesh
from scenes.pose import Pose

CANDIDATES = (2, 3, 4, 5, 6, 8)
"""Yaws in a turn that are tried."""

ROUND = 0
"""Symmetry of what looks the same at every yaw."""

ROUND_TURNS = (1 / 17, 1 / 11, 1 / 7, 1 / 5)
"""Shares of a turn that only a round object survives: none is a multiple of a candidate's."""

MIN_TOLERANCE_M = 0.004
"""Distance within which surfaces are the same, at least: below what a picture of a room shows."""

TOLERANCE_SHARE = 0.015
"""Likewise, as a share of the object's largest extent; BOP allows 10 %, which would make a round
stool's three legs round."""

COLOUR_TOLERANCE = 24.0
"""Median difference of sRGB levels (0..255) from which on a print breaks the symmetry."""

SAMPLES = 4000
"""Points spread over the surface."""

SHARE_ALIKE = 0.97
"""Of the points that must lie on the turned surface."""

SEED = 0
"""The points are the same every time."""


def yaw_symmetry(meshes: Sequence[TexturedMesh]) -> int:
    """The number of like yaws in a turn about the object's own z; 1 for none, `ROUND` for all.

    Args:
        meshes: in the object's frame, whose z axis passes through its middle.
    """
    points, colours = _spread(meshes)
    extent_m = float(np.ptp(points, axis=0).max())
    within_m = max(MIN_TOLERANCE_M, TOLERANCE_SHARE * extent_m) + _spacing(points)
    tree: Any = KDTree(points)

    def is_alike(share: float) -> bool:
        turned = Pose.from_yaw(2 * math.pi * share) @ points
        distance, nearest = tree.query(turned, workers=1)
        near = distance <= within_m
        if float(near.mean()) < SHARE_ALIKE:
            return False
        off = np.abs(colours[nearest[near]] - colours[near]).max(axis=1)
        return float(np.median(off)) < COLOUR_TOLERANCE

    if all(is_alike(share) for share in ROUND_TURNS):
        return ROUND
    return max((n for n in CANDIDATES if is_alike(1 / n)), default=1)


def _spacing(points: NDArray[np.float64]) -> float:
    """Usual distance from a point of the surface to its nearest neighbour, metres."""
    tree: Any = KDTree(points)
    distance, _ = tree.query(points, k=2, workers=1)
    return float(np.quantile(distance[:, 1], 0.9))


def _spread(
    meshes: Sequence[TexturedMesh],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(N, 3) points evenly over the surface, and (N, 3) their colours, 0..255."""
    rng = np.random.default_rng(SEED)
    corners = [mesh.vertices[mesh.faces] for mesh in meshes]
    areas = [
        0.5 * np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1)
        for c in corners
    ]
    total = sum(float(area.sum()) for area in areas)
    points: list[NDArray[np.float64]] = []
    colours: list[NDArray[np.float64]] = []
    for mesh, triangles, area in zip(meshes, corners, areas, strict=True):
        count = round(SAMPLES * float(area.sum()) / total)
        if not count:
            continue
        chosen = rng.choice(len(triangles), size=count, p=area / area.sum())
        weights = rng.dirichlet((1.0, 1.0, 1.0), size=count)
        points.append(np.einsum("nk,nkd->nd", weights, triangles[chosen]))
        uv = np.einsum("nk,nkd->nd", weights, mesh.uv[mesh.faces][chosen].astype(np.float64))
        height, width = mesh.texture.shape[:2]
        columns = np.clip((uv[:, 0] % 1.0 * width).astype(int), 0, width - 1)
        rows = np.clip(((1.0 - uv[:, 1]) % 1.0 * height).astype(int), 0, height - 1)
        colours.append(mesh.texture[rows, columns].astype(np.float64))
    return np.concatenate(points), np.concatenate(colours)
