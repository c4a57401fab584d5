"""Floor, ceiling and walls of a box-shaped room, and where pictures hang on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.samples.furniture import RoomSet
from scenes.samples.pictures.textures import FloatArray, Rgb, picture, plain, plaster
from scenes.samples.shapes import Material, Picture, quad

WALL_SOLID_M = 0.2
"""Thickness of a wall that stops objects, metres."""
SKIRTING_M = (0.07, 0.014)
"""Height and thickness of a skirting board, metres."""
WARM_WHITE: Rgb = (234, 230, 220)


@dataclass(frozen=True, slots=True, eq=False)
class Shell:
    """The inside of the walls: lowest and highest corner in metres."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def wall(self, side: str, along: float, z: float) -> Pose:
        """Frame on a wall: x right, y up, z into the room.

        Args:
            side: "+x", "-x", "+y" or "-y".
            along: world coordinate along the wall, metres.
            z: height, metres.
        """
        out = {"+x": (-1, 0), "-x": (1, 0), "+y": (0, -1), "-y": (0, 1)}[side]
        bound = self.high if side[0] == "+" else self.low
        normal, up = np.array([*out, 0.0]), np.array([0.0, 0.0, 1.0])
        at = (bound[0], along, z) if "x" in side else (along, bound[1], z)
        return Pose(np.stack([np.cross(up, normal), up, normal], axis=1), np.array(at))


def shell(
    room: RoomSet,
    inside: Shell,
    rng: np.random.Generator,
    *,
    floor: Picture,
    walls: Mapping[str, Rgb],
) -> None:
    """Adds floor, ceiling, walls and skirting, and the walls' solids.

    Args:
        room: gets the faces.
        inside: the inside of the walls.
        rng: source of the plaster's grain.
        floor: picture with +Y at its top and +X to its right.
        walls: colour by side; the others are warm white.
    """
    (x0, y0, z0), (x1, y1, z1) = inside.low, inside.high
    w, d, h = inside.high - inside.low
    ceiling = plaster(rng, (244, 244, 240), mm_per_px=8.0)
    room.add(
        quad((x0, y1, z0), (w, 0, 0), (0, -d, 0), material=picture(floor)),
        quad((x0, y0, z1), (w, 0, 0), (0, d, 0), material=ceiling),
    )
    depth, (high, thick) = WALL_SOLID_M, SKIRTING_M
    trim = plain((236, 234, 228))
    for side in ("+y", "-y", "+x", "-x"):
        paint = plaster(rng, walls.get(side, WARM_WHITE), mm_per_px=6.0)
        length = d if "x" in side else w
        middle = (y0 + y1) / 2 if "x" in side else (x0 + x1) / 2
        frame = inside.wall(side, middle, z0)
        right, out = frame.rotation[:, 0] * length / 2, frame.rotation[:, 2]
        corner = frame.translation - right + np.array([0.0, 0.0, h])
        room.add(quad(corner, 2 * right, (0, 0, -h), material=paint))
        foot = frame.translation - right + out * thick + np.array([0.0, 0.0, high])
        room.add(
            quad(foot, 2 * right, (0, 0, -high), material=trim),
            quad(foot - out * thick, 2 * right, out * thick, material=trim),
        )
        ends = np.stack([frame.translation - right, frame.translation + right - out * depth])
        ends[1, 2] = z1
        room.solid(ends.min(axis=0), ends.max(axis=0))


def floor_with_rug(
    inside: Shell,
    boards: Material,
    low: tuple[float, float],
    high: tuple[float, float],
    rug: Callable[[np.random.Generator, int, int], FloatArray],
    rng: np.random.Generator,
) -> Picture:
    """A floor picture with a rug woven into it: flat, so that chairs stand at z = 0 everywhere.

    Args:
        inside: the room.
        boards: the floor itself.
        low: lowest corner (x, y) of the rug.
        high: highest corner.
        rug: (rng, height_px, width_px) -> colours.
        rng: source of the weave.
    """
    w, d, _ = inside.high - inside.low
    floor = boards(float(w), float(d)).copy()
    per_m = np.array([floor.shape[1] / w, floor.shape[0] / d])
    x0, x1 = (round(float((v - inside.low[0]) * per_m[0])) for v in (low[0], high[0]))
    y0, y1 = (round(float((inside.high[1] - v) * per_m[1])) for v in (high[1], low[1]))
    floor[y0 - 3 : y1 + 5, x0 - 3 : x1 + 5] = floor[y0 - 3 : y1 + 5, x0 - 3 : x1 + 5] * 0.7
    floor[y0:y1, x0:x1] = np.clip(rug(rng, y1 - y0, x1 - x0), 0, 255)
    return floor
