# pyright: standard
"""Surfaces as point grids with a picture each: the bricks of the built-in rooms.

Every face of every object is a grid of points that a picture is stretched over. That one shape
serves the triangles, the texture atlas and the light bake alike. Seen from outside, columns run to
the right and rows run down, like the picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.pose import Pose

FloatArray = NDArray[np.float64]
Picture = NDArray[np.uint8]
Material = Callable[[float, float], Picture]
"""Width and height in metres -> (H, W, 3) uint8 sRGB albedo that covers them."""

STATIC_CELL_M = 0.0848
"""Grid pitch of what never moves: diagonals stay below 0.12 m, so a fisheye bends them smoothly."""

OBJECT_CELL_M = 0.03
"""Grid pitch of what moves: diagonals stay below 0.05 m."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """One face of an object.

    Attributes:
        points: (R, C, 3) float64 grid in metres, R and C at least 2.
        picture: (H, W, 3) uint8 sRGB albedo, stretched over the grid.
        glow: 0 for a face that the room lights; otherwise the face shows `picture` as it is (a
            window, a screen, a lamp).
    """

    points: FloatArray
    picture: Picture
    glow: float = 0.0


def cells(length_m: float, cell_m: float) -> int:
    """How many grid cells of at most `cell_m` a length takes, at least 1."""
    return max(1, math.ceil(length_m / cell_m - 1e-6))


def placed(surfaces: Iterable[Surface], world_from_local: Pose) -> list[Surface]:
    """The surfaces mapped by a pose."""
    return [replace(s, points=world_from_local @ s.points) for s in surfaces]


def quad(
    top_left: ArrayLike,
    right: ArrayLike,
    down: ArrayLike,
    *,
    material: Material,
    cell_m: float = STATIC_CELL_M,
    glow: float = 0.0,
) -> Surface:
    """A parallelogram from its top-left corner and two edge vectors (metres), seen from outside."""
    corner, across, along = (np.asarray(v, dtype=np.float64) for v in (top_left, right, down))
    width, height = float(np.linalg.norm(across)), float(np.linalg.norm(along))
    columns, rows = _grid_cells(width, height, cell_m)
    s, t = np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1)
    points = corner + s[None, :, None] * across + t[:, None, None] * along
    return Surface(points, material(width, height), glow)


def box(
    low: Sequence[float],
    high: Sequence[float],
    *,
    material: Material,
    faces: str = "+x-x+y-y+z-z",
    cell_m: float = STATIC_CELL_M,
) -> list[Surface]:
    """An axis-aligned box between two corners (metres), with only the faces that can be seen."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    w, d, h = x1 - x0, y1 - y0, z1 - z0
    frames = {
        "-y": ((x0, y0, z1), (w, 0, 0), (0, 0, -h)),
        "+y": ((x1, y1, z1), (-w, 0, 0), (0, 0, -h)),
        "+x": ((x1, y0, z1), (0, d, 0), (0, 0, -h)),
        "-x": ((x0, y1, z1), (0, -d, 0), (0, 0, -h)),
        "+z": ((x0, y1, z1), (w, 0, 0), (0, -d, 0)),
        "-z": ((x0, y0, z0), (w, 0, 0), (0, d, 0)),
    }
    return [
        quad(*frame, material=material, cell_m=cell_m)
        for name, frame in frames.items()
        if name in faces
    ]


def rounded_outline(
    size_x: float, size_y: float, *, radius: float, cell_m: float
) -> tuple[FloatArray, int, int]:
    """A rectangle with round corners about the origin, counter-clockwise seen from above.

    Returns:
        (N + 1, 2) closed points that start at the (-x, -y) corner, and the cells per x and y side;
        `radius` = half the size gives a circle.
    """
    half = np.array([size_x, size_y]) / 2
    radius = min(radius, float(half.min()))
    nx, ny = cells(size_x, cell_m), cells(size_y, cell_m)
    if radius > 0:
        nx, ny = max(nx, 4), max(ny, 4)
    inner = half - radius
    quarter = np.linspace(0, math.pi / 4, 9)
    sides = []
    for side in range(4):
        turn = side * math.pi / 2
        a, b = (inner[0], inner[1]) if side % 2 == 0 else (inner[1], inner[0])
        start = np.stack(
            [-a - radius * np.sin(quarter)[::-1], -b - radius * np.cos(quarter)[::-1]], axis=1
        )
        end = np.stack([a + radius * np.sin(quarter), -b - radius * np.cos(quarter)], axis=1)
        line = np.concatenate([start, end])
        c, s = math.cos(turn), math.sin(turn)
        sides.append(_resample(line @ np.array([[c, s], [-s, c]]), nx if side % 2 == 0 else ny))
    return np.concatenate([*(side[:-1] for side in sides), sides[0][:1]]), nx, ny


def prism(
    outline: tuple[FloatArray, int, int],
    profile: Sequence[tuple[float, float]],
    *,
    side: Material,
    top: Material | None = None,
    bottom: Material | None = None,
    caps: str = "+-",
    cell_m: float = OBJECT_CELL_M,
) -> list[Surface]:
    """A solid with one outline at every height, such as a cushion, a rounded board or a round leg.

    Args:
        outline: from `rounded_outline`.
        profile: (inset, z) pairs from the top down, metres; the outline shrinks by the inset.
        side: picture of the mantle.
        top: picture of the upper cap; the mantle's if not given.
        bottom: picture of the lower cap; the mantle's if not given.
        caps: "+" for the upper cap, "-" for the lower one.
        cell_m: largest grid pitch down the mantle.
    """
    line, nx, ny = outline
    half = np.abs(line).max(axis=0)
    steps = _resample_profile(np.asarray(profile, dtype=np.float64), cell_m)
    scale = 1.0 - steps[:, :1] / half
    rings = np.empty((len(steps), len(line), 3))
    rings[:, :, :2] = line[None] * scale[:, None, :]
    rings[:, :, 2] = steps[:, 1:]
    height = float(np.linalg.norm(np.diff(steps, axis=0), axis=1).sum())
    around = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    surfaces = [Surface(rings, side(around, height))]
    width, depth = 2 * half
    if "+" in caps:
        grid = _cap(line * scale[0], nx, ny, float(steps[0, 1]))
        surfaces.append(Surface(grid[::-1], (top or side)(width, depth)))
    if "-" in caps:
        grid = _cap(line * scale[-1], nx, ny, float(steps[-1, 1]))
        surfaces.append(Surface(grid, (bottom or side)(width, depth)))
    return surfaces


def bar(
    start: ArrayLike,
    end: ArrayLike,
    *,
    width: float,
    depth: float,
    material: Material,
    radius: float = 0.0,
    taper: float = 0.0,
    caps: str = "+-",
    cell_m: float = OBJECT_CELL_M,
) -> list[Surface]:
    """A straight bar with a rectangular or round section, from `start` to `end` (metres).

    Args:
        start: centre of the lower end.
        end: centre of the upper end.
        width: section along the local x axis, which stays as level as it can.
        depth: section along the local y axis.
        material: picture of all faces.
        radius: of the long edges; half the width gives a round bar.
        taper: how much thinner each side is at `start`.
        caps: as in `prism`.
        cell_m: largest grid pitch.
    """
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    length = float(np.linalg.norm(b - a))
    outline = rounded_outline(width, depth, radius=radius, cell_m=cell_m)
    solid = prism(outline, [(0.0, length), (taper, 0.0)], side=material, caps=caps, cell_m=cell_m)
    return placed(solid, Pose(_axes_along((b - a) / length), a))


def lathe(
    profile: Sequence[tuple[float, float]],
    *,
    material: Material,
    around: int = 20,
    cell_m: float = OBJECT_CELL_M,
) -> Surface:
    """A surface of revolution about Z from (radius, z) pairs in metres.

    A profile from the top down shows its outer side, one from the bottom up its inner side.
    """
    steps = _resample_profile(np.asarray(profile, dtype=np.float64), cell_m)
    angle = np.linspace(0.0, 2 * math.pi, around + 1)
    points = np.empty((len(steps), around + 1, 3))
    points[:, :, 0] = steps[:, :1] * np.cos(angle)
    points[:, :, 1] = steps[:, :1] * np.sin(angle)
    points[:, :, 2] = steps[:, 1:]
    height = float(np.linalg.norm(np.diff(steps, axis=0), axis=1).sum())
    return Surface(points, material(2 * math.pi * float(steps[:, 0].max()), height))


def _grid_cells(width: float, height: float, cell_m: float) -> tuple[int, int]:
    """(columns, rows) whose diagonals stay below that of a square cell; strips get longer cells."""
    columns, rows = cells(width, cell_m), cells(height, cell_m)
    diagonal = cell_m * math.sqrt(2.0)
    if columns == 1:
        rows = cells(height, math.sqrt(diagonal**2 - width**2))
    elif rows == 1:
        columns = cells(width, math.sqrt(diagonal**2 - height**2))
    return columns, rows


def _axes_along(direction: FloatArray) -> FloatArray:
    """(3, 3) rotation whose third column is `direction`, its first as near to world x as can be."""
    hint = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    y = np.cross(direction, hint)
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, direction), y, direction], axis=1)


def _resample(line: FloatArray, count: int) -> FloatArray:
    """(count + 1, 2) points at equal distances along a polyline."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    wanted = np.linspace(0.0, along[-1], count + 1)
    return np.stack([np.interp(wanted, along, line[:, k]) for k in range(2)], axis=1)


def _resample_profile(profile: FloatArray, cell_m: float) -> FloatArray:
    """The profile with points added so that no step exceeds `cell_m`; its corners stay."""
    parts = []
    for a, b in pairwise(profile):
        n = cells(float(np.linalg.norm(b - a)), cell_m)
        parts.append(a + (b - a) * (np.arange(n) / n)[:, None])
    return np.concatenate([*parts, profile[-1:]])


def _cap(line: FloatArray, nx: int, ny: int, z: float) -> FloatArray:
    """(ny + 1, nx + 1, 3) grid inside a closed outline, rows from -y to +y (Coons patch)."""
    bottom = line[: nx + 1]
    right = line[nx : nx + ny + 1]
    top = line[nx + ny : 2 * nx + ny + 1][::-1]
    left = line[2 * nx + ny : 2 * nx + 2 * ny + 1][::-1]
    s = np.linspace(0, 1, nx + 1)[None, :, None]
    t = np.linspace(0, 1, ny + 1)[:, None, None]
    corners = (
        (1 - s) * (1 - t) * bottom[0] + s * (1 - t) * bottom[-1] + (1 - s) * t * top[0]
        + s * t * top[-1]
    )  # fmt: skip
    grid = (1 - t) * bottom[None] + t * top[None] + (1 - s) * left[:, None] + s * right[:, None]
    flat = grid - corners
    return np.concatenate([flat, np.full((*flat.shape[:2], 1), z)], axis=2)
