# pyright: standard
"""Points on textured meshes: where a surface bake puts its splats, and what colour is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from scenes.mesh import TexturedMesh

FloatArray = NDArray[np.float64]
LOOKUP_ROWS = 30_000
"""cv2.remap refuses maps of more than 32767 rows."""


@dataclass(frozen=True, slots=True, eq=False)
class Soup:
    """Triangles of several meshes side by side.

    Attributes:
        corners: (T, 3, 3) float64, metres.
        uv: (T, 3, 2) float64.
        normals: (T, 3) float64, unit, outwards.
        areas: (T,) float64, square metres.
        textures: one picture per mesh.
        mesh_of: (T,) index into `textures`.
    """

    corners: FloatArray
    uv: FloatArray
    normals: FloatArray
    areas: FloatArray
    textures: tuple[NDArray[np.uint8], ...]
    mesh_of: NDArray[np.int64]

    def select(self, index: NDArray[np.int64]) -> Soup:
        """The triangles with these indices."""
        return Soup(
            self.corners[index],
            self.uv[index],
            self.normals[index],
            self.areas[index],
            self.textures,
            self.mesh_of[index],
        )


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoints:
    """N points on a `Soup`.

    Attributes:
        triangle: (N,) triangle index.
        barycentric: (N, 3) weights of its corners.
    """

    triangle: NDArray[np.int64]
    barycentric: FloatArray

    def __len__(self) -> int:
        return len(self.triangle)

    def select(self, index: NDArray[np.int64]) -> SurfacePoints:
        """The points with these indices."""
        return SurfacePoints(self.triangle[index], self.barycentric[index])


def soup_of(meshes: Sequence[TexturedMesh]) -> Soup:
    """The triangles of the meshes; those of no area are left out.

    Raises:
        ValueError: there is no triangle with an area.
    """
    corners = np.concatenate([m.vertices[m.faces] for m in meshes])
    uv = np.concatenate([m.uv[m.faces] for m in meshes]).astype(np.float64)
    mesh_of = np.repeat(np.arange(len(meshes)), [len(m.faces) for m in meshes])
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    real = twice > 1e-12
    if not real.any():
        raise ValueError(f"surface: {len(meshes)} meshes without any triangle of positive area")
    return Soup(
        corners[real],
        uv[real],
        cross[real] / twice[real, None],
        twice[real] / 2,
        tuple(m.texture for m in meshes),
        mesh_of[real],
    )


def scatter(
    soup: Soup, count: int, rng: np.random.Generator, *, pull: FloatArray | None = None
) -> SurfacePoints:
    """`count` points: systematic over triangles in proportion to `pull`, low-discrepancy inside.

    Args:
        soup: the triangles.
        count: how many points.
        rng: source of the sampling.
        pull: (T,) weight per triangle; its area if not given.
    """
    cumulative = np.cumsum(soup.areas if pull is None else pull)
    ticks = (np.arange(count) + rng.random(count)) / count * cumulative[-1]
    triangle = np.searchsorted(cumulative, ticks).clip(0, len(cumulative) - 1)
    plastic = np.array([0.7548776662466927, 0.5698402909980532])
    a, b = ((np.arange(count)[:, None] * plastic + rng.random(2)) % 1.0).T
    over = a + b > 1
    a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    return SurfacePoints(triangle, np.stack([1 - a - b, a, b], axis=1))


def positions(soup: Soup, points: SurfacePoints) -> FloatArray:
    """(N, 3) metres."""
    return np.einsum("nk,nkd->nd", points.barycentric, soup.corners[points.triangle])


def colours(soup: Soup, points: SurfacePoints) -> NDArray[np.float32]:
    """(N, 3) bilinear texture colours, 0..255."""
    return lookup(soup, points, soup.textures)


def lookup(
    soup: Soup, points: SurfacePoints, pictures: Sequence[NDArray[np.uint8] | NDArray[np.float32]]
) -> NDArray[np.float32]:
    """(N, C) bilinear lookups in pictures that are laid out like the textures, one per mesh."""
    uv = np.einsum("nk,nkd->nd", points.barycentric, soup.uv[points.triangle])
    channels = pictures[0].shape[2]
    out = np.empty((len(points), channels), dtype=np.float32)
    of = soup.mesh_of[points.triangle]
    for number, source in enumerate(pictures):
        here = np.flatnonzero(of == number)
        height, width = source.shape[:2]
        x = (uv[here, 0] * width - 0.5).astype(np.float32)[:, None]
        y = ((1.0 - uv[here, 1]) * height - 0.5).astype(np.float32)[:, None]
        for first in range(0, len(here), LOOKUP_ROWS):
            part = slice(first, first + LOOKUP_ROWS)
            looked_up = cv2.remap(
                source, x[part], y[part], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            )
            out[here[part]] = looked_up.reshape(-1, channels)
    return out


def pixel_axes(soup: Soup) -> FloatArray:
    """(T, 2, 3) metres per texture pixel to the right and down, along each triangle."""
    sizes = np.array([[t.shape[1], t.shape[0]] for t in soup.textures], dtype=np.float64)
    pixels = soup.uv * sizes[soup.mesh_of][:, None, :] * np.array([1.0, -1.0])
    in_pixels = np.stack([pixels[:, 1] - pixels[:, 0], pixels[:, 2] - pixels[:, 0]], axis=1)
    in_metres = np.stack(
        [soup.corners[:, 1] - soup.corners[:, 0], soup.corners[:, 2] - soup.corners[:, 0]], axis=1
    )
    (a, b), (c, d) = np.moveaxis(in_pixels, 0, 2)
    det = a * d - b * c
    det = np.where(np.abs(det) > 1e-9, det, 1e9)
    inverse = np.stack([np.stack([d, -b], 1), np.stack([-c, a], 1)], 1) / det[:, None, None]
    return inverse @ in_metres


def nearby(
    soup: Soup, points: SurfacePoints, offsets_m: FloatArray, *, frames: FloatArray
) -> SurfacePoints:
    """The points moved within their triangles, stopped at the triangles' edges.

    Args:
        soup: the triangles.
        points: N points.
        offsets_m: (N, 2) metres along the first two rows of `frames`.
        frames: (N, 3, 3) tangent, tangent, normal per point.
    """
    corners = soup.corners[points.triangle]
    shift = np.einsum("nk,nkd->nd", offsets_m, frames[:, :2])
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    g11, g12, g22 = (np.einsum("nd,nd->n", a, b) for a, b in ((e1, e1), (e1, e2), (e2, e2)))
    p1, p2 = np.einsum("nd,nd->n", shift, e1), np.einsum("nd,nd->n", shift, e2)
    det = g11 * g22 - g12 * g12
    step = np.stack([(g22 * p1 - g12 * p2) / det, (g11 * p2 - g12 * p1) / det], axis=1)
    moved = points.barycentric + np.stack([-step.sum(axis=1), step[:, 0], step[:, 1]], axis=1)
    inside = np.maximum(moved, 0.0)
    return SurfacePoints(points.triangle, inside / inside.sum(axis=1, keepdims=True))


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Points along edges of a surface.

    Attributes:
        tree: search tree of the points, metres.
        directions: (M, 3) unit vectors along the edges.
    """

    tree: KDTree
    directions: FloatArray


def find_edges(soup: Soup, *, angle_rad: float, step_m: float) -> Edges:
    """Free edges and those where the surface bends back by more than `angle_rad`.

    Inner corners, as between floor and wall, do not count: nothing can reach past them. Edges are
    sampled every `step_m`. Where there are none, as on a sphere, one far away stands in for them.
    """
    welded = np.unique(
        np.round(soup.corners.reshape(-1, 3) / 1e-5).astype(np.int64), axis=0, return_inverse=True
    )[1].reshape(-1, 3)
    pairs = np.stack([welded, np.roll(welded, -1, axis=1)], axis=2).reshape(-1, 2)
    ends = np.stack([soup.corners, np.roll(soup.corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    owner = np.repeat(np.arange(len(welded)), 3)
    key = pairs.min(axis=1) * (welded.max() + 1) + pairs.max(axis=1)
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    a, b = owner[order[first]], owner[order[np.minimum(first + 1, len(order) - 1)]]
    bent = np.einsum("nd,nd->n", soup.normals[a], soup.normals[b]) < np.cos(angle_rad)
    beside = soup.corners[b].mean(axis=1) - soup.corners[a].mean(axis=1)
    bent &= np.einsum("nd,nd->n", soup.normals[a], beside) < 0
    chosen = ends[order[first[(count != 2) | bent]]]
    if not len(chosen):
        return Edges(KDTree(np.full((1, 3), 1e6)), np.array([[1.0, 0.0, 0.0]]))
    spans = chosen[:, 1] - chosen[:, 0]
    lengths = np.linalg.norm(spans, axis=1)
    per_edge = np.maximum(1, np.ceil(lengths / step_m)).astype(np.int64)
    index = np.repeat(np.arange(len(chosen)), per_edge)
    rank = np.arange(len(index)) - np.repeat(np.cumsum(per_edge) - per_edge, per_edge)
    fraction = ((rank + 0.5) / per_edge[index])[:, None]
    points = chosen[index, 0] * (1 - fraction) + chosen[index, 1] * fraction
    return Edges(KDTree(points), spans[index] / np.maximum(lengths[index, None], 1e-12))
