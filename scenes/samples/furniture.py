# pyright: standard
"""Furniture that stays: desk, shelf, cabinet and what lies on them. World coordinates, metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from scenes.mesh import BoxPart
from scenes.pose import Pose
from scenes.samples.shapes import Material, Surface, box


@dataclass(slots=True)
class RoomSet:
    """Parts of a room while it is built.

    Attributes:
        surfaces: all faces so far.
        solids: all boxes that stop objects so far.
    """

    surfaces: list[Surface] = field(default_factory=list)
    solids: list[BoxPart] = field(default_factory=list)

    def add(self, *surfaces: Surface) -> None:
        """More faces."""
        self.surfaces.extend(surfaces)

    def solid(self, low: Sequence[float], high: Sequence[float]) -> None:
        """A box between two corners that stops objects."""
        a, b = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        half = (b - a) / 2
        self.solids.append(
            BoxPart(Pose(np.eye(3), (a + b) / 2), (float(half[0]), float(half[1]), float(half[2])))
        )

    def block(
        self,
        low: Sequence[float],
        high: Sequence[float],
        material: Material,
        *,
        faces: str = "+x-x+y-y+z-z",
        solid: bool = False,
        cell_m: float = 0.082,
    ) -> None:
        """A box of one material, and its solid if asked for."""
        self.add(*box(low, high, material=material, faces=faces, cell_m=cell_m))
        if solid:
            self.solid(low, high)


def table(
    room: RoomSet,
    low: Sequence[float],
    high: Sequence[float],
    *,
    top: Material,
    legs: Material,
    thickness: float = 0.03,
) -> None:
    """A table between two corners of its bounding box; legs are square, 5 cm in from the edges."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    room.block((x0, y0, z1 - thickness), (x1, y1, z1), top, solid=True)
    for x in (x0 + 0.04, x1 - 0.09):
        for y in (y0 + 0.04, y1 - 0.09):
            leg = (x, y, z0), (x + 0.05, y + 0.05, z1 - thickness)
            room.block(*leg, legs, faces="+x-x+y-y", solid=True)
    for y in (y0 + 0.055, y1 - 0.075):
        rail = (x0 + 0.09, y, z1 - thickness - 0.07), (x1 - 0.09, y + 0.02, z1 - thickness)
        room.block(*rail, legs, faces="+y-y-z")


def shelf_unit(
    room: RoomSet,
    low: Sequence[float],
    high: Sequence[float],
    *,
    material: Material,
    boards: int,
    open_side: str,
    thickness: float = 0.022,
) -> list[float]:
    """A case with boards, open to "-y", "+y" or "-x"; returns the heights of the boards' tops."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    t = thickness
    room.solid(low, high)
    if open_side.endswith("y"):
        back = (y1 - t, y1) if open_side == "-y" else (y0, y0 + t)
        room.block((x0, y0, z0), (x0 + t, y1, z1), material)
        room.block((x1 - t, y0, z0), (x1, y1, z1), material)
        room.block((x0 + t, back[0], z0), (x1 - t, back[1], z1), material, faces="+y-y")
        inner = (x0 + t, y0), (x1 - t, y1)
    else:
        room.block((x0, y0, z0), (x1, y0 + t, z1), material)
        room.block((x0, y1 - t, z0), (x1, y1, z1), material)
        room.block((x1 - t, y0 + t, z0), (x1, y1 - t, z1), material, faces="+x-x")
        inner = (x0, y0 + t), (x1, y1 - t)
    heights = [float(z) for z in np.linspace(z0 + 0.06, z1 - t, boards)]
    for z in heights:
        room.block((*inner[0], z), (*inner[1], z + t), material, faces=f"{open_side}+z-z")
    return [z + t for z in heights[:-1]]
