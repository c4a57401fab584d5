"""The box around an object in cells, which photos saw or did not.

The box stands for the object's surface: what nobody saw of the object, nobody saw through that part
of its box, whatever the splats there look like. Sides go by the axes of the object's frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Outward axis of each side of a box, in the order of a record."""

NORMALS: FloatArray = np.array(
    [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
)
"""(6, 3) outward normals of the sides."""

TOP, BOTTOM = SIDES.index("+z"), SIDES.index("-z")
"""Places of the two level sides."""

GRID = 8
"""Cells of a side each way, so that a side is 64 bits: 5 cm of a chair, 3 cm of a book."""


@dataclass(frozen=True, slots=True, eq=False)
class BoxCells:
    """Cells of all sides of a box, in the object's frame.

    Attributes:
        points: (6, 64, 3) their middles, metres.
        areas_m2: (6,) area of one cell of each side.
    """

    points: FloatArray
    areas_m2: FloatArray

    def facing(self, eye: FloatArray) -> FloatArray:
        """(6, 64) cosine between each cell's normal and the way to an eye (3,)."""
        away = eye - self.points
        length = np.maximum(np.linalg.norm(away, axis=2), 1e-12)
        return np.einsum("ska,sa->sk", away, NORMALS) / length


def box_cells(box_m: tuple[float, float, float]) -> BoxCells:
    """Cells of the box that stands on its frame's origin, extents in metres."""
    half, middle = 0.5 * np.array(box_m), np.array([0.0, 0.0, 0.5 * box_m[2]])
    step = (np.arange(GRID) + 0.5) * (2.0 / GRID) - 1.0
    down, across = (axis.ravel() for axis in np.meshgrid(step, step, indexing="ij"))
    points = np.empty((len(SIDES), GRID * GRID, 3))
    areas = np.empty(len(SIDES))
    for side, normal in enumerate(NORMALS):
        axis = int(np.argmax(np.abs(normal)))
        first, second = (other for other in range(3) if other != axis)
        unit = np.zeros((GRID * GRID, 3))
        unit[:, axis], unit[:, first], unit[:, second] = normal[axis], down, across
        points[side] = middle + half * unit
        areas[side] = 4.0 * half[first] * half[second] / (GRID * GRID)
    return BoxCells(points, areas)
