"""Prepares meshes for drawing through a fisheye: short edges and vertex normals.

A vertex-level projection bends no edge, so edges have to be short. An edge is halved or not by its
own two ends alone, so that neighbours agree and no crack opens between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import TexturedMesh

MAX_ROUNDS = 12
POSITION_STEP_M = 1e-5
HASH_MULTIPLIER = np.uint64(0x9E3779B97F4A7C15)


@dataclass(frozen=True, slots=True, eq=False)
class FineMesh:
    """A mesh ready to be drawn.

    Attributes:
        vertices: (V, 3) float64, metres.
        normals: (V, 3) float64, unit, pointing outwards.
        uv: (V, 2) float64.
        faces: (F, 3) int64.
        texture: (H, W, 3) uint8.
    """

    vertices: NDArray[np.float64]
    normals: NDArray[np.float64]
    uv: NDArray[np.float64]
    faces: NDArray[np.int64]
    texture: NDArray[np.uint8]


def refine_mesh(
    mesh: TexturedMesh,
    *,
    max_edge_m: float,
    eye: NDArray[np.float64] | None = None,
    max_edge_rad: float = 0.0,
    crease_rad: float = 0.7,
) -> FineMesh:
    """Split edges until none is longer than allowed; normals are smooth except over creases.

    Args:
        mesh: what to refine.
        max_edge_m: longest edge in metres.
        eye: (3,) where it is seen from, in the mesh's frame; lets far edges stay long.
        max_edge_rad: with `eye`, an edge may also be this long seen from there.
        crease_rad: faces that meet at a larger angle keep an edge between them.
    """
    faces = mesh.faces.astype(np.int64)
    normals = _corner_normals(mesh.vertices, faces, crease_rad)
    uv = mesh.uv.astype(np.float64)
    attributes = np.concatenate([mesh.vertices[faces], normals, uv[faces]], axis=2)
    for _ in range(MAX_ROUNDS):
        split = _edges_to_split(attributes[:, :, :3], max_edge_m, eye, max_edge_rad)
        if not split.any():
            break
        attributes = _split_triangles(attributes, split)
    unique, inverse = _shared_rows(attributes.reshape(-1, 8))
    length = np.linalg.norm(unique[:, 3:6], axis=1, keepdims=True)
    return FineMesh(
        vertices=np.ascontiguousarray(unique[:, :3]),
        normals=unique[:, 3:6] / np.maximum(length, 1e-12),
        uv=np.ascontiguousarray(unique[:, 6:]),
        faces=inverse.reshape(-1, 3).astype(np.int64),
        texture=mesh.texture,
    )


def _shared_rows(
    rows: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The distinct rows and each row's place among them, found by a 64-bit hash of their bits."""
    hashes = np.zeros(len(rows), np.uint64)
    bits = np.ascontiguousarray(rows + 0.0).view(np.uint64)
    for column in range(rows.shape[1]):
        hashes ^= bits[:, column]
        hashes *= HASH_MULTIPLIER
        hashes ^= hashes >> np.uint64(29)
    _, first, inverse = np.unique(hashes, return_index=True, return_inverse=True)
    return rows[first], inverse


def _edges_to_split(
    corners: NDArray[np.float64],
    max_edge_m: float,
    eye: NDArray[np.float64] | None,
    max_edge_rad: float,
) -> NDArray[np.bool_]:
    """(F, 3): edge k runs from corner k to corner k+1."""
    following = np.roll(corners, -1, axis=1)
    length = np.linalg.norm(following - corners, axis=2)
    limit: NDArray[np.float64] | float = max_edge_m
    if eye is not None:
        distance = np.linalg.norm(0.5 * (corners + following) - eye, axis=2)
        limit = np.maximum(max_edge_m, max_edge_rad * (distance - 0.5 * length))
    return length > limit


def _split_triangles(
    attributes: NDArray[np.float64], split: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """(F, 3, A) triangles to more of them: each marked edge is halved at its middle."""
    count = split.sum(axis=1)
    pieces = [attributes[count == 0]]
    for marked in (1, 2, 3):
        rows = np.flatnonzero(count == marked)
        if len(rows) == 0:
            continue
        a, b, c, ab, bc, ca = _rotated(attributes[rows], split[rows], marked)
        if marked == 1:
            triangles = [(a, ab, c), (ab, b, c)]
        elif marked == 2:
            triangles = [(ab, b, bc), (a, ab, bc), (a, bc, c)]
        else:
            triangles = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        pieces += [np.stack(triangle, axis=1) for triangle in triangles]
    return np.concatenate(pieces)


def _rotated(
    attributes: NDArray[np.float64], split: NDArray[np.bool_], marked: int
) -> tuple[NDArray[np.float64], ...]:
    """Corners and edge middles, turned so that the marked edges come first."""
    if marked == 1:
        first = np.argmax(split, axis=1)
    elif marked == 2:
        first = (np.argmin(split, axis=1) + 1) % 3
    else:
        first = np.zeros(len(split), dtype=np.int64)
    rows = np.arange(len(split))
    a, b, c = (attributes[rows, (first + k) % 3] for k in range(3))
    return a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)


def _corner_normals(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], crease_rad: float
) -> NDArray[np.float64]:
    """(F, 3, 3) unit normals per face corner, averaged over the faces within the crease angle."""
    corners = vertices[faces]
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(weighted, axis=1, keepdims=True)
    unit = weighted / np.maximum(length, 1e-20)
    _, position = _shared_rows(np.round(vertices / POSITION_STEP_M))
    corner_position = position[faces].ravel()
    face_of_corner = np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(corner_position, kind="stable")
    starts = np.flatnonzero(np.diff(corner_position[order], prepend=-1))
    sizes = np.diff(np.append(starts, len(order)))
    first, second = _pairs_within_groups(starts, sizes)
    first, second = order[first], order[second]
    near = np.einsum(
        "ij,ij->i", unit[face_of_corner[first]], unit[face_of_corner[second]]
    ) > np.cos(crease_rad)
    normals = np.zeros((len(faces) * 3, 3))
    np.add.at(normals, first[near], weighted[face_of_corner[second[near]]])
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    flat = unit[face_of_corner]
    smooth = np.asarray(np.where(size > 1e-20, normals / np.maximum(size, 1e-20), flat), np.float64)
    return smooth.reshape(-1, 3, 3)


def _pairs_within_groups(
    starts: NDArray[np.int64], sizes: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All ordered pairs (i, j) of members of the same group, groups being runs of an index."""
    size_of_member = np.repeat(sizes, sizes)
    start_of_member = np.repeat(starts, sizes)
    first = np.repeat(np.arange(int(sizes.sum())), size_of_member)
    offset = np.arange(len(first)) - np.repeat(
        np.cumsum(size_of_member) - size_of_member, size_of_member
    )
    return first, start_of_member[first] + offset
