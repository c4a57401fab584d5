"""Flat rectangles of a physical room: where a board's corners truly are, and what is painted on it.

The room's meshes are cut into small triangles; those of one face lie in one plane and touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from scenes.mesh import PhysicalRoom, TexturedMesh
from scenes.quad import Quad
from scenes.rays import RayScene

FloatArray = NDArray[np.float64]

SAME_PLANE = 1e-4
"""Triangles whose plane differs by less, in metres and in the normal's parts, are of one face."""

BEFORE_M = 0.003
"""How far in front of a face the rays start that look up its paint."""


@dataclass(frozen=True)
class FlatFaces:
    """The faces of a room's static meshes."""

    room: PhysicalRoom

    @cached_property
    def _triangles(self) -> FloatArray:
        return np.concatenate([mesh.vertices[mesh.faces] for mesh in self.room.static])

    @cached_property
    def _rays(self) -> RayScene:
        return RayScene(self._triangles)

    def rectangle_towards(self, place: ArrayLike) -> FloatArray:
        """(4, 3) corners of the upright face that the camera sees where a place is, in metres.

        Clockwise from the top left, as somebody in the room sees it.

        Raises:
            ValueError: there is nothing, or the face is no upright rectangle.
        """
        eye = self.room.world_from_rig.translation
        direction = np.asarray(place, dtype=np.float64) - eye
        hit = int(self._rays.cast(eye[None], direction[None]).triangle[0])
        if hit < 0:
            raise ValueError(f"room {self.room.name!r}: nothing is seen towards {place}")
        points = self._face_of(hit)
        normal = _normals(self._triangles[hit][None])[0]
        right = np.cross([0.0, 0.0, 1.0], normal)
        right /= np.linalg.norm(right)
        along, height = points @ right, points[:, 2]
        left_end, right_end = along.min(), along.max()
        corners = [
            right * x + normal * (points[0] @ normal) + [0.0, 0.0, z]
            for x, z in (
                (left_end, height.max()),
                (right_end, height.max()),
                (right_end, height.min()),
                (left_end, height.min()),
            )
        ]
        found = np.array(corners)
        missing = [float(np.linalg.norm(points - corner, axis=1).min()) for corner in found]
        if max(missing) > SAME_PLANE:
            raise ValueError(f"room {self.room.name!r}: the face at {place} is no rectangle")
        return found

    def painting(self, quad: Quad, size_px: tuple[int, int]) -> NDArray[np.uint8]:
        """(H, W, 3) what is painted on a quad, at its pixel centres, as the meshes have it."""
        fine = 4
        width, height = fine * size_px[0], fine * size_px[1]
        x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
        points, _ = quad.points(np.stack([x.ravel(), y.ravel()], axis=1))
        inward = quad.world_from_plane.rotation[:, 2]
        directions = np.broadcast_to(inward, points.shape)
        hits = self._rays.cast(points - BEFORE_M * inward, directions)
        colours = self._colours(points, hits.triangle)
        return np.asarray(
            cv2.resize(colours.reshape(height, width, 3), size_px, interpolation=cv2.INTER_AREA),
            dtype=np.uint8,
        )

    def _face_of(self, triangle: int) -> FloatArray:
        """(N, 3) vertices of all triangles of the face that one triangle belongs to."""
        normals = _normals(self._triangles)
        offsets = np.einsum("tc,tc->t", normals, self._triangles[:, 0])
        coplanar = np.abs(normals - normals[triangle]).max(axis=1) < SAME_PLANE
        coplanar &= np.abs(offsets - offsets[triangle]) < SAME_PLANE
        chosen = np.flatnonzero(coplanar)
        corners = self._triangles[chosen].reshape(-1, 3)
        _, number = np.unique(np.round(corners / SAME_PLANE), axis=0, return_inverse=True)
        count = int(number.max()) + 1
        owner = np.repeat(np.arange(len(chosen)), 3)
        joined = coo_array(
            (np.ones(len(owner)), (owner, len(chosen) + number.ravel())),
            shape=(len(chosen) + count,) * 2,
        )
        _, group = connected_components(joined, directed=False)
        own = group[int(np.flatnonzero(chosen == triangle)[0])]
        return corners[np.repeat(group[: len(chosen)] == own, 3)]

    def _colours(self, points: FloatArray, triangle: NDArray[np.int64]) -> NDArray[np.uint8]:
        """(N, 3) texture colours at points of triangles, bilinear."""
        colours = np.zeros((len(points), 3), np.uint8)
        first = 0
        for mesh in self.room.static:
            here = (triangle >= first) & (triangle < first + len(mesh.faces))
            colours[here] = _painted(mesh, points[here], triangle[here] - first)
            first += len(mesh.faces)
        return colours


def _normals(triangles: FloatArray) -> FloatArray:
    """(T, 3) unit normals; 0 where a triangle has no area."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)


def _painted(
    mesh: TexturedMesh, points: FloatArray, triangle: NDArray[np.int64]
) -> NDArray[np.uint8]:
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces[triangle]], 1, 0)
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (np.einsum("nc,nc->n", s, t) for s, t in ((u, u), (u, v), (v, v)))
    wu, wv = (np.einsum("nc,nc->n", w, t) for t in (u, v))
    area = np.maximum(uu * vv - uv * uv, 1e-18)
    along_u, along_v = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    shares = np.stack([1 - along_u - along_v, along_u, along_v], axis=1)
    place = np.einsum("nk,nkc->nc", shares, mesh.uv[mesh.faces[triangle]].astype(np.float64))
    height, width = mesh.texture.shape[:2]
    x = place[:, 0] * width - 0.5
    y = (1.0 - place[:, 1]) * height - 0.5
    left = np.clip(np.floor(x).astype(int), 0, width - 2)
    top = np.clip(np.floor(y).astype(int), 0, height - 2)
    fx, fy = np.clip(x - left, 0, 1)[:, None], np.clip(y - top, 0, 1)[:, None]
    upper = mesh.texture[top, left] * (1 - fx) + mesh.texture[top, left + 1] * fx
    lower = mesh.texture[top + 1, left] * (1 - fx) + mesh.texture[top + 1, left + 1] * fx
    return np.round(upper * (1 - fy) + lower * fy).astype(np.uint8)
