# pyright: standard
"""Solid boxes that stand in for an object where it collides, and a guess of its mass.

Collision needs few convex parts. Splats lie on surfaces, and the undersides of objects are seldom
seen; so cells with walls on most sides are taken for solid, and what is solid is covered with
upright boxes, the largest first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from scenes.mesh import BoxPart
from scenes.pose import Pose, rotation_from_quaternion
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]

CELLS_ALONG = 28
"""Cells along the longest side."""
CELL_M = (0.01, 0.04)
"""A cell's side at least and at most, metres."""
SOLID = 0.5
"""Opacity in a cell from which on it is filled."""
MAX_PARTS = 16
"""Boxes that an object is made of, for the physics' sake."""
WALLS = 4
"""Sides of four that have to be walled in for a cell to be inside."""
MIN_PART_SHARE = 0.01
"""Of what is solid: a part that adds less is left out."""

DENSITY_OF_SIZE = ((0.4, 350.0), (1.3, 220.0), (np.inf, 150.0))
"""Longest side in metres, and kg/m³ of what is solid: books and boxes; chairs and stools, whose
legs take more cells than wood; cupboards and sofas, which are hollow."""


def solid_parts(cloud: SplatCloud, box_m: tuple[float, float, float]) -> tuple[BoxPart, ...]:
    """Boxes that cover what is solid of an object; one of the size of `box_m` if little is known.

    Args:
        cloud: the object's splats in its own frame: origin on the support plane, Z up, metres.
        box_m: its extents (x, y, z); nothing of a part lies outside.
    """
    size, cell = _grid(box_m)
    return _boxes(_enclose(_fill(cloud, size, cell)), size, cell)


def solid_parts_of_surface(
    points: NDArray[np.float64], box_m: tuple[float, float, float]
) -> tuple[BoxPart, ...]:
    """Boxes that cover what is solid of an object whose surface is known, such as a mesh's.

    Args:
        points: (N, 3) closely all over its surface, in its own frame: origin on the support plane,
            Z up, metres.
        box_m: its extents (x, y, z); nothing of a part lies outside.
    """
    size, cell = _grid(box_m)
    shape = np.round(size / cell).astype(np.intp)
    corner = np.array([-0.5 * size[0], -0.5 * size[1], 0.0])
    index = np.floor((points - corner) / cell).astype(np.intp)
    walls = np.zeros(tuple(shape), dtype=bool)
    walls[tuple(np.clip(index, 0, shape - 1).T)] = True
    return _boxes(_enclose(walls), size, cell)


def _grid(box_m: tuple[float, float, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Extents of an object and of the cells that divide them, metres."""
    size = np.maximum(np.array(box_m, dtype=np.float64), 1e-3)
    return size, size / np.maximum(np.round(size / np.clip(size.max() / CELLS_ALONG, *CELL_M)), 1)


def _boxes(
    filled: BoolArray, size: NDArray[np.float64], cell: NDArray[np.float64]
) -> tuple[BoxPart, ...]:
    total = int(filled.sum())
    parts: list[BoxPart] = []
    left = filled.copy()
    while left.any() and len(parts) < MAX_PARTS:
        low, high = _largest_box(left)
        left[low[0] : high[0], low[1] : high[1], low[2] : high[2]] = False
        if parts and np.prod(high - low) < MIN_PART_SHARE * total:
            break
        centre = 0.5 * (low + high) * cell - (0.5 * size[0], 0.5 * size[1], 0.0)
        half = 0.5 * (high - low) * cell
        parts.append(_part(centre, half))
    return tuple(parts) or (_part(np.array([0.0, 0.0, 0.5 * size[2]]), 0.5 * size),)


def guessed_mass_kg(parts: Sequence[BoxPart], box_m: tuple[float, float, float]) -> float:
    """A mass for parts that do not overlap: their volume times a density typical of the size.

    It is a guess from size alone, easily wrong by a factor of three.
    """
    volume = sum(8.0 * float(np.prod(part.half_size_m)) for part in parts)
    density = next(kg for longest, kg in DENSITY_OF_SIZE if max(box_m) <= longest)
    return volume * density


def _part(centre: NDArray[np.float64], half: NDArray[np.float64]) -> BoxPart:
    x, y, z = (float(extent) for extent in half)
    return BoxPart(Pose(np.eye(3), centre), (x, y, z))


def _fill(cloud: SplatCloud, size: NDArray[np.float64], cell: NDArray[np.float64]) -> BoolArray:
    """(X, Y, Z) cells that hold enough opacity, sampled on each splat's two larger axes."""
    shape = tuple(int(n) for n in np.round(size / cell))
    through = np.zeros(shape)
    if not len(cloud):
        return through > 0
    corner = np.array([-0.5 * size[0], -0.5 * size[1], 0.0])
    order = np.argsort(-cloud.scales, axis=1)[:, :2]
    scales = np.take_along_axis(cloud.scales.astype(np.float64), order, axis=1)
    turned = rotation_from_quaternion(cloud.rotations)
    axes = np.take_along_axis(turned, order[:, None, :], axis=2) * scales[:, None, :]
    clear = np.log1p(-np.clip(cloud.opacities.astype(np.float64), 0.0, 0.99))
    steps = (-1.0, -0.5, 0.0, 0.5, 1.0)
    for u in steps:
        for v in steps:
            points = cloud.means + u * axes[:, :, 0] + v * axes[:, :, 1]
            at = (points - corner) / cell
            # Faces lie on the box: half of their splats are a little outside.
            inside = ((at > -1) & (at < np.array(shape) + 1)).all(axis=1)
            index = np.clip(np.floor(at).astype(np.intp), 0, np.array(shape) - 1)[inside]
            weight = clear[inside] * np.exp(-0.5 * (u * u + v * v))
            # A splat's samples share it: all of them in one cell fill it once.
            np.add.at(through, tuple(index.T), weight / 5.0)
    return 1.0 - np.exp(through) > SOLID


def _enclose(filled: BoolArray) -> BoolArray:
    """The filled cells, and those that are walled in to at least `WALLS` of four sides and above.

    One side may be missing: scans have gaps, and nobody sees undersides.
    """
    closed = np.asarray(ndimage.binary_closing(np.pad(filled, 2), np.ones((3, 3, 3))), dtype=bool)
    walls = closed[2:-2, 2:-2, 2:-2] | filled
    blocked = np.zeros(walls.shape, dtype=np.int8)
    for axis, ends in ((0, (1, -1)), (1, (1, -1)), (2, (-1,))):
        for step in ends:
            turned = np.flip(walls, axis) if step < 0 else walls
            behind = np.logical_or.accumulate(turned, axis=axis)
            blocked += np.flip(behind, axis) if step < 0 else behind
    return walls | (blocked >= WALLS)


def _largest_box(filled: BoolArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and past-the-last corner of the box of most cells that are all filled.

    Grown from the cell deepest inside, one layer at a time on the side where most is won.
    """
    padded = ndimage.distance_transform_cdt(np.pad(filled, 1), metric="chessboard")
    depth = np.asarray(padded)[1:-1, 1:-1, 1:-1]
    seeds = np.argwhere(depth == depth.max())
    best = (np.zeros(3, dtype=np.intp), np.zeros(3, dtype=np.intp))
    for seed in seeds[:: max(len(seeds) // 12, 1)]:
        for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            low, high = _grow(filled, seed, order)
            if np.prod(high - low) > np.prod(best[1] - best[0]):
                best = low, high
    return best


def _grow(
    filled: BoolArray, seed: NDArray[np.intp], order: tuple[int, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The box around a cell, stretched along one axis after the other while it stays filled."""
    low, high = seed.copy(), seed + 1
    for axis in order:
        layer = [slice(first, last) for first, last in zip(low, high, strict=True)]
        while low[axis] > 0:
            layer[axis] = slice(low[axis] - 1, low[axis])
            if not filled[tuple(layer)].all():
                break
            low[axis] -= 1
        while high[axis] < filled.shape[axis]:
            layer[axis] = slice(high[axis], high[axis] + 1)
            if not filled[tuple(layer)].all():
                break
            high[axis] += 1
    return low, high
