"""Triangles cut at the planes of a grid, so that every piece lies in one cell."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MIN_PIECE_M2 = 1e-9
"""Area below which a piece of a triangle is left out, m²: far too little to fit a plane."""
SNAP = 1e-7
"""Share of a cell within which a corner counts as lying on a plane of the grid."""
PHASES = 64
"""How many places of the grid are compared per axis: every 4 mm, as a headset's noise."""
NEAR_PHASES = 2
"""Surfaces within this many of a boundary count as on it."""
PARTS = 4
"""Finest parts of a cell; a surface on a boundary of those is cut to shreds as well."""
FACING = 0.9
"""Cosine above which a triangle faces an axis: within 26 degrees."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Cubic cells, turned about up so that they run along the walls.

    Attributes:
        cell_m: side of a cell.
        yaw: of the cells' x axis, radians.
        origin_m: (x, y, z) of a corner of cells, in the turned frame.
    """

    cell_m: float
    yaw: float
    origin_m: tuple[float, float, float]

    def turn(self) -> Array:
        """(3, 3) `world_from_grid`, a rotation about up."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def from_world(self, points: Array) -> Array:
        """Points (..., 3) of the world in the grid's frame: cell k covers k..k + 1 cells."""
        return points @ self.turn() - np.asarray(self.origin_m)

    def to_world(self, points: Array) -> Array:
        """Points (..., 3) of the grid's frame in the world."""
        return (points + np.asarray(self.origin_m)) @ self.turn().T


def area_vectors(triangles: Array) -> Array:
    """(T, 3) normals of triangles (T, 3, 3), as long as the area, m²."""
    return 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def grid_along_walls(triangles: Array, cell_m: float) -> Grid:
    """The grid whose cells run along the walls, with no surface on a boundary of cells.

    A wall on a boundary would fall into two cells in turn and be cut to shreds by its own noise.

    Args:
        triangles: (T, 3, 3) world metres.
        cell_m: side of a cell.
    """
    vectors = area_vectors(triangles)
    yaw = _yaw_of_walls(vectors)
    turn = Grid(cell_m, yaw, (0.0, 0.0, 0.0)).turn()
    centres, vectors = triangles.mean(axis=1) @ turn, vectors @ turn
    areas = np.linalg.norm(vectors, axis=1)
    origin: list[float] = []
    for axis in range(3):
        faces = np.abs(vectors[:, axis]) > FACING * areas
        phase = np.floor(centres[faces, axis] / cell_m % 1.0 * PHASES).astype(np.int64) % PHASES
        weight = np.bincount(phase, weights=areas[faces], minlength=PHASES)
        near = sum(
            (np.roll(weight, k) for k in range(-NEAR_PHASES, NEAR_PHASES + 1)), np.zeros(PHASES)
        )
        parts = sum((np.roll(near, k * PHASES // PARTS) for k in range(PARTS)), near)
        origin.append((int(np.argmin(parts)) + 0.5) / PHASES * cell_m)
    return Grid(cell_m, yaw, (origin[0], origin[1], origin[2]))


def cut_at_grid(triangles: Array, cell_m: float) -> Array:
    """Triangles (T, 3, 3) of the grid's frame, cut so that each lies in one cell.

    The union of the pieces is the union of the triangles; orientations are kept.
    """
    pieces = triangles
    for axis in range(3):
        done: list[Array] = []
        while len(pieces):
            along = pieces[:, :, axis] / cell_m
            low = np.floor(lowest(along) + SNAP)
            high = np.ceil(highest(along) - SNAP)
            whole = high - low <= 1.0
            done.append(pieces[whole])
            middle = np.floor(0.5 * (low + high))[~whole] * cell_m
            pieces = _cut(pieces[~whole], axis, middle)
        pieces = np.concatenate(done) if done else pieces
    return pieces


def cells_of(pieces: Array, cell_m: float) -> NDArray[np.int64]:
    """(T, 3) cell of each piece (T, 3, 3) of the grid's frame."""
    return np.floor(centres(pieces) / cell_m).astype(np.int64)


def lowest(corners: Array) -> Array:
    """(T, ...) least of three values (T, 3, ...): thrice as fast as a reduction."""
    return np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2])


def highest(corners: Array) -> Array:
    """(T, ...) greatest of three values (T, 3, ...)."""
    return np.maximum(np.maximum(corners[:, 0], corners[:, 1]), corners[:, 2])


def centres(corners: Array) -> Array:
    """(T, ...) mean of three values (T, 3, ...)."""
    return (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3.0


def _yaw_of_walls(vectors: Array) -> float:
    """Direction of the walls, radians in -45..45 degrees: the mean of four times the angle."""
    level = np.hypot(vectors[:, 0], vectors[:, 1])
    upright = level > FACING * np.linalg.norm(vectors, axis=1)
    angle = np.arctan2(vectors[upright, 1], vectors[upright, 0])
    mean = complex(np.sum(level[upright] * np.exp(4j * angle)))
    return 0.25 * math.atan2(mean.imag, mean.real) if abs(mean) > 0.0 else 0.0


def _cut(triangles: Array, axis: int, at_m: Array) -> Array:
    """Each triangle (T, 3, 3) cut by its own plane across an axis, in up to three."""
    if not len(triangles):
        return triangles
    height = triangles[:, :, axis] - at_m[:, None]
    above = height > 0.0
    # The corner alone on its side comes first.
    is_lone = above == (above.sum(axis=1) == 1)[:, None]
    order = (np.argmax(is_lone, axis=1)[:, None] + np.arange(3)) % 3
    rows = np.arange(len(triangles))[:, None]
    corner, height = triangles[rows, order], height[rows, order]
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    to_b = (height[:, 0] / (height[:, 0] - height[:, 1]))[:, None]
    to_c = (height[:, 0] / (height[:, 0] - height[:, 2]))[:, None]
    ab, ac = a + to_b * (b - a), a + to_c * (c - a)
    ab[:, axis] = ac[:, axis] = at_m
    pieces = np.concatenate(
        [np.stack([a, ab, ac], 1), np.stack([ab, b, c], 1), np.stack([ab, c, ac], 1)]
    )
    return pieces[np.linalg.norm(area_vectors(pieces), axis=1) > MIN_PIECE_M2]
