# pyright: standard
"""Packs the pictures of many surfaces into one texture and their grids into one mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import TexturedMesh
from scenes.samples.shapes import Picture, Surface

GUTTER_PX = 4
"""Border around every picture, so that bilinear lookups never see a neighbour."""

MAX_HEIGHT_PX = 8192
"""Larger textures are refused by some graphics drivers."""


def mesh_from_surfaces(surfaces: Sequence[Surface], *, width_px: int = 2048) -> TexturedMesh:
    """One textured mesh; triangles of no area (at poles) are left out.

    Args:
        surfaces: at least one.
        width_px: of the texture; its height follows.

    Raises:
        ValueError: the pictures do not fit a texture of `MAX_HEIGHT_PX` rows, or one is too wide.
    """
    corners, height_px = _pack([s.picture.shape[:2] for s in surfaces], width_px)
    texture = np.full((height_px, width_px, 3), 128, dtype=np.uint8)
    vertices, faces, uv, first = [], [], [], 0
    for surface, (x, y) in zip(surfaces, corners, strict=True):
        h, w = surface.picture.shape[:2]
        _paste(texture, surface.picture, x, y)
        rows, columns = surface.points.shape[:2]
        s, t = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
        uv.append(
            np.stack([(x + s * w) / width_px, 1.0 - (y + t * h) / height_px], axis=2).reshape(-1, 2)
        )
        vertices.append(surface.points.reshape(-1, 3))
        faces.append(grid_faces(rows, columns) + first)
        first += rows * columns
    points = np.concatenate(vertices)
    triangles = np.concatenate(faces)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    real = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12
    return TexturedMesh(
        points,
        triangles[real].astype(np.int32),
        np.concatenate(uv).astype(np.float32),
        texture,
    )


def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Counter-clockwise triangles seen with columns to the right and rows down."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    lower = np.stack([a, c, d], axis=2).reshape(-1, 3)
    upper = np.stack([a, d, b], axis=2).reshape(-1, 3)
    return np.concatenate([lower, upper])


def _pack(sizes: Sequence[tuple[int, int]], width_px: int) -> tuple[list[tuple[int, int]], int]:
    """Top-left pixels of (height, width) pictures on shelves, and the total height."""
    corners: list[tuple[int, int]] = [(0, 0)] * len(sizes)
    x = y = shelf = 0
    for index in sorted(range(len(sizes)), key=lambda i: (-sizes[i][0], -sizes[i][1], i)):
        h, w = sizes[index][0] + 2 * GUTTER_PX, sizes[index][1] + 2 * GUTTER_PX
        if w > width_px:
            raise ValueError(
                f"atlas: picture {index} is {w} px wide with its border, limit {width_px}; "
                "make the atlas wider or the picture coarser"
            )
        if x + w > width_px:
            x, y, shelf = 0, y + shelf, 0
        corners[index] = (x + GUTTER_PX, y + GUTTER_PX)
        x, shelf = x + w, max(shelf, h)
    height_px = y + shelf
    if height_px > MAX_HEIGHT_PX:
        raise ValueError(f"atlas: {height_px} px high, limit {MAX_HEIGHT_PX}; use coarser pictures")
    return corners, height_px


def _paste(texture: Picture, picture: Picture, x: int, y: int) -> None:
    h, w = picture.shape[:2]
    g = GUTTER_PX
    texture[y - g : y + h + g, x - g : x + w + g] = np.pad(
        picture, ((g, g), (g, g), (0, 0)), mode="edge"
    )
