"""Shapes as signed distances, blended, and their surfaces as triangles (naive surface nets)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.bodies.vectors import Array, length

Shape = Callable[[Array], Array]
"""Takes points (..., 3) in metres and returns their distance to a surface (...), negative
inside."""


def cone(start: ArrayLike, end: ArrayLike, *, radii: tuple[float, float]) -> Shape:
    """Return a rounded limb from one point to another.

    Args:
        start: (3,) metres.
        end: (3,) metres.
        radii: at both, metres.
    """
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    axis = b - a

    def distance(points: Array) -> Array:
        share = np.clip(((points - a) @ axis) / max(float(axis @ axis), 1e-12), 0.0, 1.0)
        off = points - a - share[..., None] * axis
        return np.sqrt((off * off).sum(axis=-1)) - (radii[0] + share * (radii[1] - radii[0]))

    return distance


def ellipsoid(centre: ArrayLike, radii: ArrayLike) -> Shape:
    """Return an ellipsoid along the axes, metres; distances are right near its surface."""
    c, r = np.asarray(centre, np.float64), np.asarray(radii, np.float64)

    def distance(points: Array) -> Array:
        local = (points - c) / r
        size = np.sqrt((local * local).sum(axis=-1))
        slope = np.sqrt(((local / r) ** 2).sum(axis=-1))
        return size * (size - 1.0) / np.maximum(slope, 1e-9)

    return distance


def turned_profile(rings: Sequence[tuple[float, float, float, float]]) -> Shape:
    """Return an upright solid of ellipses.

    Args:
        rings: height z, half width along x, along y, shift along x; metres, from below.
    """
    table = np.asarray(rings, np.float64)
    fine = np.linspace(float(table[0, 0]), float(table[-1, 0]), 160)
    curves = [_eased(table[:, 0], table[:, k], where=fine) for k in (1, 2, 3)]

    def distance(points: Array) -> Array:
        z = points[..., 2]
        along, aside, shift = (np.interp(z, fine, curve) for curve in curves)
        x, y = (points[..., 0] - shift) / along, points[..., 1] / aside
        level = (np.sqrt(x * x + y * y) - 1.0) * np.minimum(along, aside)
        outside = np.maximum(table[0, 0] - z, z - table[-1, 0])
        return np.maximum(level, outside)

    return distance


def union(*shapes: Shape, blend_m: float = 0.0) -> Shape:
    """Return all shapes together, blended over a width in metres."""

    def distance(points: Array) -> Array:
        found = shapes[0](points)
        for shape in shapes[1:]:
            other = shape(points)
            gap = np.maximum(blend_m - np.abs(found - other), 0.0) / max(blend_m, 1e-9)
            found = np.minimum(found, other) - gap * gap * blend_m * 0.25
        return found

    return distance


def common(first: Shape, second: Shape, *, blend_m: float = 0.0) -> Shape:
    """Return where both shapes are."""
    joined = union(lambda p: -first(p), lambda p: -second(p), blend_m=blend_m)
    return lambda points: -joined(points)


def grown(shape: Shape, by_m: float) -> Shape:
    """Return a shape thicker by a length."""
    return lambda points: shape(points) - by_m


def half_space(normal: ArrayLike, offset_m: float) -> Shape:
    """Return all points p with p · normal < offset."""
    n = np.asarray(normal, np.float64)
    n = n / np.sqrt(n @ n)
    return lambda points: points @ n - offset_m


def surface(
    shape: Shape, low: ArrayLike, *, high: ArrayLike, step_m: float
) -> tuple[Array, NDArray[np.int32], Array]:
    """Return vertices (V, 3), triangles (F, 3) and outward normals (V, 3) of a shape.

    Args:
        shape: inside the box.
        low: (3,) least corner of the box, metres.
        high: (3,) greatest corner.
        step_m: length of a grid's cell.
    """
    first = np.asarray(low, np.float64) - 1.5 * step_m
    counts = np.ceil((np.asarray(high, np.float64) + 1.5 * step_m - first) / step_m).astype(int) + 1
    cells = np.argwhere(np.ones(counts, np.bool_)).reshape(*counts, 3)
    grid = first + step_m * cells
    values = shape(grid)
    numbers, places = _crossed_cells(values)
    vertices = first + step_m * places
    vertices, normals = _onto(shape, vertices, step_m=step_m)
    faces = _faces(values < 0.0, numbers)
    # Cells are joined by the side that is inside; a face seen from inside is turned round.
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    facing = np.einsum("ni,ni->n", np.cross(b - a, c - a), normals[faces].sum(axis=1))
    faces[facing < 0.0] = faces[facing < 0.0][:, ::-1]
    return vertices, faces.astype(np.int32), normals


def _eased(at: Array, values: Array, *, where: Array) -> Array:
    """Return a smooth curve through values that does not overshoot (monotone cubic)."""
    slopes = np.diff(values) / np.diff(at)
    inner = np.where(
        slopes[:-1] * slopes[1:] > 0,
        2 * slopes[:-1] * slopes[1:] / (slopes[:-1] + slopes[1:] + 1e-12),
        0,
    )
    ends = np.concatenate([slopes[:1], inner, slopes[-1:]])
    k = np.clip(np.searchsorted(at, where, side="right") - 1, 0, len(slopes) - 1)
    width = np.diff(at)[k]
    t = (where - at[k]) / width
    return (
        (1 + 2 * t) * (1 - t) ** 2 * values[k]
        + t * (1 - t) ** 2 * width * ends[k]
        + t * t * (3 - 2 * t) * values[k + 1]
        + t * t * (t - 1) * width * ends[k + 1]
    )


_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
"""(8, 3) corners of a cell."""

_EDGES = [(a, b) for a in range(8) for b in range(8) if a < b and bin(a ^ b).count("1") == 1]
"""Pairs of corners with an edge between them."""


def _crossed_cells(values: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the number of each cell's vertex, -1 for none, and vertices in cells' units."""
    shape = tuple(n - 1 for n in values.shape)
    corner = np.stack(
        [values[i : i + shape[0], j : j + shape[1], k : k + shape[2]] for i, j, k in _CORNERS],
        axis=-1,
    )
    inside = corner < 0.0
    crossed = inside.any(axis=-1) & ~inside.all(axis=-1)
    picked, total, count = corner[crossed], np.zeros((int(crossed.sum()), 3)), 0
    for a, b in _EDGES:
        first, second = picked[:, a], picked[:, b]
        cuts = (first < 0.0) != (second < 0.0)
        share = np.where(cuts, first / np.where(cuts, first - second, 1.0), 0.0)[:, None]
        total += cuts[:, None] * (_CORNERS[a] + share * (_CORNERS[b] - _CORNERS[a]))
        count = count + cuts
    cells = np.full(shape, -1, np.int64)
    cells[crossed] = np.arange(len(picked))
    return cells, np.argwhere(crossed) + total / np.asarray(count)[:, None]


def _faces(inside: NDArray[np.bool_], cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return triangles between the four cells around each edge of the grid that is cut."""
    found: list[NDArray[np.int64]] = []
    for axis in range(3):
        near = np.moveaxis(inside, axis, 0)
        cell = np.moveaxis(cells, axis, 0)
        cut = near[:-1, 1:-1, 1:-1] != near[1:, 1:-1, 1:-1]
        a, b, c, d = cell[:, :-1, :-1], cell[:, 1:, :-1], cell[:, 1:, 1:], cell[:, :-1, 1:]
        quads = np.stack([each[cut] for each in (a, b, c, d)], axis=1)
        found += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    return np.concatenate(found)


def _onto(shape: Shape, vertices: Array, *, step_m: float) -> tuple[Array, Array]:
    """Return vertices moved onto the surface, at most half a cell, and the normals there."""
    slope = _slope(shape, vertices, step_m=step_m)
    for _ in range(2):
        size = np.maximum(length(slope), 0.2)[:, None]
        move = np.clip(shape(vertices), -0.5 * step_m, 0.5 * step_m)[:, None]
        vertices = vertices - move * slope / size**2
        slope = _slope(shape, vertices, step_m=step_m)
    return vertices, slope / np.maximum(length(slope), 1e-9)[:, None]


def _slope(shape: Shape, points: Array, *, step_m: float) -> Array:
    """Return (V, 3) how fast the distance grows in points along the axes."""
    tiny = 0.1 * step_m
    sides = [shape(points + tiny * axis) - shape(points - tiny * axis) for axis in np.eye(3)]
    return np.stack(sides, axis=-1) / (2 * tiny)
