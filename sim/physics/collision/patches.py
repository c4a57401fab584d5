"""A scanned surface as boxes: one flat patch per cell and direction, finer where it is not flat.

A patch's face lies in the surface, its body behind it, away from the free side. The body is as
thick as `DEPTH_M`, less where another surface looks the other way closer behind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.physics.collision.grid import (
    Array,
    Grid,
    area_vectors,
    cells_of,
    centres,
    cut_at_grid,
    highest,
    lowest,
)

CELL_M = 0.25
"""Side of a cell. Of 0.15, 0.25 and 0.5 m the middle one keeps furniture's shape at a speed that
the physics affords."""
FINEST_LEVEL = 2
"""How often a cell is halved where its surface is not one flat piece: down to 6 cm."""
ROUGHNESS_M = 0.006
"""Spread (standard deviation) of a surface about its patch, above which the cell is halved: a
headset's mesh has 4 mm of noise."""
FILL = 0.7
"""Share of a patch's rectangle that the surface has to cover, or the cell is halved."""
MIN_FILL = 0.3
"""Share at the finest level below which a patch is a stray shred."""
MIN_AREA_M2 = 3e-4
"""Smallest surface in a cell that becomes a patch: a third of the finest cell's side."""
STRAY_SHARE = 0.25
"""Share of a cell's main surface below which pieces of another direction may be its noise."""
STRAY_FACING = 0.25
"""Cosine to the main surface's axis above which they are: an edge at a right angle stays one."""
DEPTH_M = 0.10
"""Thickness behind the surface: at 8 m/s and 2 ms a step an object enters by up to 4 cm."""


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Flat rectangles with a body behind them.

    Attributes:
        centre: (N, 3) centre of the face, world metres.
        world_from_patch: (N, 3, 3) rotations; the third column looks to the free side.
        half_m: (N, 2) half sides of the face along the first two columns.
        depth_m: (N,) thickness behind the face.
        cell: (N, 3) int64, cell of the grid that the patch was fitted in.
    """

    centre: Array
    world_from_patch: Array
    half_m: Array
    depth_m: Array
    cell: NDArray[np.int64]

    def __len__(self) -> int:
        """How many patches there are."""
        return len(self.centre)

    @property
    def normal(self) -> Array:
        """(N, 3) unit vectors to the free side."""
        return self.world_from_patch[:, :, 2]

    @property
    def area_m2(self) -> Array:
        """(N,) of the faces."""
        return 4.0 * self.half_m[:, 0] * self.half_m[:, 1]

    def chosen(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> Patches:
        """Some of them."""
        return Patches(
            self.centre[which],
            self.world_from_patch[which],
            self.half_m[which],
            self.depth_m[which],
            self.cell[which],
        )


def joined(*parts: Patches) -> Patches:
    """All patches of several sets, in order."""
    return Patches(
        np.concatenate([part.centre for part in parts]),
        np.concatenate([part.world_from_patch for part in parts]),
        np.concatenate([part.half_m for part in parts]),
        np.concatenate([part.depth_m for part in parts]),
        np.concatenate([part.cell for part in parts]),
    )


def fit_patches(pieces: Array, grid: Grid) -> Patches:
    """Patches of a surface, `DEPTH_M` thick (`depths.py` makes thin solids thin).

    Args:
        pieces: (T, 3, 3) triangles of the grid's frame, each in one cell (`cut_at_grid`).
        grid: its cells.
    """
    found: list[tuple[Array, Array, Array]] = []
    for level in range(FINEST_LEVEL + 1):
        if not len(pieces):
            break
        fitted, is_good, group = _fit_level(pieces, grid.cell_m / 2**level, level)
        found.append(tuple(part[is_good] for part in fitted))  # type: ignore[arg-type]
        # A negative group has too little surface to matter.
        again = np.isin(group, np.flatnonzero(~is_good))
        pieces = cut_at_grid(pieces[again], grid.cell_m / 2 ** (level + 1))
    centre = np.concatenate([f[0] for f in found]) if found else np.zeros((0, 3))
    rotation = np.concatenate([f[1] for f in found]) if found else np.zeros((0, 3, 3))
    half = np.concatenate([f[2] for f in found]) if found else np.zeros((0, 2))
    # A step into the body: a face may lie in the boundary of two cells.
    inside = centre - 1e-6 * rotation[:, :, 2]
    return Patches(
        grid.to_world(centre),
        grid.turn() @ rotation,
        half,
        np.full(len(centre), DEPTH_M),
        np.floor(inside / grid.cell_m).astype(np.int64),
    )


def _fit_level(
    pieces: Array, cell_m: float, level: int
) -> tuple[tuple[Array, Array, Array], NDArray[np.bool_], NDArray[np.intp]]:
    """One patch per cell and direction.

    Returns:
        (centre (G, 3), rotation (G, 3, 3), half sides (G, 2)); whether each is good (G,); the
        group of each piece (T,), negative for none.
    """
    vectors = area_vectors(pieces)
    group, area = _groups(pieces, vectors, cell_m)
    kept = group >= 0
    pieces, vectors, index = pieces[kept], vectors[kept], group[kept]
    weight = np.linalg.norm(vectors, axis=1)
    count = len(area)
    total = _sums(index, vectors, count)
    flat_area = np.linalg.norm(total, axis=1)
    normal = total / np.maximum(flat_area, 1e-12)[:, None]
    centre = _sums(index, weight[:, None] * centres(pieces), count) / area[:, None]
    corners = pieces - centre[index][:, None]
    rotation = _rotations(normal)
    local = np.einsum("tck,tka->tca", corners, rotation[index])
    square = centres(local[:, :, 2] ** 2)
    rough = np.sqrt(_sums(index, (weight * square)[:, None], count)[:, 0] / area)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, index, lowest(local[:, :, :2]))
    np.maximum.at(high, index, highest(local[:, :, :2]))
    half = 0.5 * (high - low)
    middle = 0.5 * (high + low)
    centre = centre + np.einsum("gka,ga->gk", rotation[:, :, :2], middle)
    fill = flat_area / np.maximum(4.0 * half[:, 0] * half[:, 1], 1e-12)
    is_last = level == FINEST_LEVEL
    is_good = (fill > MIN_FILL) if is_last else (fill > FILL) & (rough < ROUGHNESS_M)
    return (centre, rotation, half), is_good, group


def _groups(pieces: Array, vectors: Array, cell_m: float) -> tuple[NDArray[np.intp], Array]:
    """Group of each piece by cell and the axis it faces (negative: too small), areas of groups."""
    key = cells_of(pieces, cell_m)
    key -= key.min(axis=0)
    spans = key.max(axis=0) + 1
    _, cell = np.unique(np.ravel_multi_index(tuple(key.T), tuple(spans)), return_inverse=True)
    side = _sides(vectors, cell)
    _, group = np.unique(6 * cell + side, return_inverse=True)
    size = np.linalg.norm(vectors, axis=1)
    area = np.asarray(np.bincount(group, weights=size), dtype=np.float64)
    is_kept = area >= MIN_AREA_M2
    renumbered: NDArray[np.intp] = np.where(is_kept, np.cumsum(is_kept) - 1, -1)
    return renumbered[group], area[is_kept]


def _sides(vectors: Array, cell: NDArray[np.intp]) -> NDArray[np.intp]:
    """(T,) which of six directions each piece faces.

    A stray piece, tilted by the scan's noise, goes with the surface that fills its cell.
    """
    size = np.linalg.norm(vectors, axis=1)
    axis = np.argmax(np.abs(vectors), axis=1)
    rows = np.arange(len(vectors))
    side = np.asarray(2 * axis + (vectors[rows, axis] > 0.0), dtype=np.intp)
    area = np.bincount(6 * cell + side, weights=size, minlength=6 * (int(cell.max()) + 1))
    area = area.reshape(-1, 6)
    main: NDArray[np.intp] = np.argmax(area, axis=1)[cell]
    is_small = area[cell, side] < STRAY_SHARE * area[cell, main]
    with_main = vectors[rows, main // 2] * np.where(main % 2 == 1, 1.0, -1.0)
    return np.where(is_small & (with_main > STRAY_FACING * size), main, side)


def _sums(index: NDArray[np.intp], values: Array, count: int) -> Array:
    """(count, K) sums of values (T, K) by index."""
    sums = [np.bincount(index, weights=column, minlength=count) for column in values.T]
    return np.asarray(np.column_stack(sums), dtype=np.float64)


def _rotations(normal: Array) -> Array:
    """(G, 3, 3) with the normal as third column and the first along the grid where it can be."""
    axis = np.argmax(np.abs(normal), axis=1)
    along = np.eye(3)[(axis + 1) % 3]
    first = along - normal * np.sum(along * normal, axis=1)[:, None]
    first /= np.maximum(np.linalg.norm(first, axis=1), 1e-12)[:, None]
    return np.asarray(np.stack([first, np.cross(normal, first), normal], axis=2), np.float64)
