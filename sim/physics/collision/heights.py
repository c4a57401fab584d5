"""How high the surface below a point is."""

from __future__ import annotations

import math

import numpy as np

from sim.physics.collision.grid import Array, area_vectors
from sim.physics.collision.surface import Surface

LEVEL = 0.7
"""Cosine to up above which a surface can carry: 45 degrees."""
EDGE = -1e-6
"""Share of a triangle by which a point may lie outside it: on an edge it belongs to both."""


def height_below(surface: Surface, point: Array, *, gap_m: float) -> float:
    """World height of the highest level surface at or below a point (3,), metres.

    Args:
        surface: what stands still.
        point: world metres.
        gap_m: how far above the point a surface may lie and still carry it.
    """
    best = _floor_height(surface, point)
    grid, ceiling = surface.grid, float(point[2]) + gap_m
    local = grid.from_world(np.array([point[0], point[1], ceiling]))
    column, row, top = (math.floor(value / grid.cell_m) for value in local.tolist())
    floor_cell = math.floor((best - grid.origin_m[2]) / grid.cell_m)
    for level in range(top, floor_cell - 1, -1):
        pieces = surface.pieces.get((column, row, level))
        if pieces is None:
            continue
        heights = _heights_at(pieces, local[:2])
        heights = heights[heights <= local[2]]
        if len(heights):
            return max(best, float(heights.max()) + grid.origin_m[2])
    return best


def _floor_height(surface: Surface, point: Array) -> float:
    """Of the lowest half-space that looks up; where the scan has a hole it is what carries."""
    heights = [
        (plane.offset_m - float(np.dot(plane.normal[:2], point[:2]))) / plane.normal[2]
        for plane in surface.planes
        if plane.normal[2] > LEVEL
    ]
    return max(heights, default=0.0)


def _heights_at(pieces: Array, place: Array) -> Array:
    """Heights at a place (2,) of those level triangles (T, 3, 3) that lie over or under it."""
    vectors = area_vectors(pieces)
    pieces = pieces[vectors[:, 2] > LEVEL * np.linalg.norm(vectors, axis=1)]
    a, b, c = pieces[:, 0], pieces[:, 1], pieces[:, 2]
    double = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    to_b = (place[0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (place[1] - a[:, 1])
    to_c = (b[:, 0] - a[:, 0]) * (place[1] - a[:, 1]) - (place[0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    u, v = to_b / double, to_c / double
    inside = (u >= EDGE) & (v >= EDGE) & (u + v <= 1.0 - EDGE)
    heights = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
    return np.asarray(heights[inside], dtype=np.float64)
