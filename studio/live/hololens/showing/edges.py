"""Boxes, lines and arrows made of shapes that a headset can draw."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devices.hololens.display_list import Colour, Shape, Solid
from scenes.pose import Pose

Floats = NDArray[np.float64]

CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
"""(8, 3) corners of a box of 1 m."""

EDGES = tuple(
    (a, b)
    for a in range(8)
    for b in range(a + 1, 8)
    if int(np.abs(CORNERS[a] - CORNERS[b]).sum()) == 1
)
"""Pairs of corners between which a box has an edge."""

HEAD_SHARE, HEAD_WIDTH = 0.35, 0.5
"""Of an arrow: the barbs' length of the whole, and the shaft's width of the whole's."""

WHITE: Colour = (1.0, 1.0, 1.0, 1.0)
"""Of edges that are kept for any colour."""

MAX_BOXES = 256
"""Boxes whose edges are kept: a room has tens of objects, each in one or two widths."""

MIN_LENGTH_M = 1e-4
"""Length below which a line is none."""


def rod(start: Floats, end: Floats, *, width_m: float, colour: Colour) -> Solid | None:
    """Return a thin cylinder between two points; None where they are the same."""
    way = end - start
    length = float(np.linalg.norm(way))
    if length < MIN_LENGTH_M:
        return None
    pose = Pose(rotation_to(way / length), 0.5 * (start + end))
    return Solid(Shape.CYLINDER, pose, (width_m, width_m, length), colour)


def rotation_to(direction: Floats) -> Floats:
    """Return (3, 3) a rotation that takes z to a direction of length 1."""
    across = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(across, direction)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(direction, x), direction], axis=1)


def outline(
    device_from_base: Pose, box_m: tuple[float, float, float], *, width_m: float, colour: Colour
) -> dict[str, Solid]:
    """Return the edges of a box, by name, that stands on the origin of a frame."""
    return {
        name: replace(edge, world_from_item=device_from_base @ edge.world_from_item, colour=colour)
        for name, edge in _outline(box_m, width_m).items()
    }


@lru_cache(maxsize=MAX_BOXES)
def _outline(box_m: tuple[float, float, float], width_m: float) -> dict[str, Solid]:
    """Return the edges of a box that stands on the origin: to aim them takes longest."""
    corners = np.add(CORNERS, (0.0, 0.0, 0.5)) * np.asarray(box_m)
    found: dict[str, Solid] = {}
    for number, (a, b) in enumerate(EDGES):
        made = rod(corners[a], corners[b], width_m=width_m, colour=WHITE)
        if made is not None:
            found[f"edge{number}"] = made
    return found


def polyline(
    points: Floats, *, width_m: float, colour: Colour, tolerance_m: float
) -> dict[str, Solid]:
    """Return a line as rods by name: as few as stay within a tolerance of it."""
    kept = points[simplified(points, tolerance_m)]
    found: dict[str, Solid] = {}
    for number, (start, end) in enumerate(pairwise(kept)):
        made = rod(start, end, width_m=width_m, colour=colour)
        if made is not None:
            found[f"part{number}"] = made
    return found


def simplified(points: Floats, tolerance_m: float) -> list[int]:
    """Return which points of a line stay, the first and the last among them.

    A point stays where the line would be off by more than the tolerance without it, as far as those
    before it: points that have been drawn keep their place while the line grows.
    """
    kept = [0] if len(points) else []
    for k in range(2, len(points)):
        start, end = points[kept[-1]], points[k]
        between = points[kept[-1] + 1 : k]
        way = end - start
        length = float(np.linalg.norm(way))
        if length < MIN_LENGTH_M:
            off = float(np.linalg.norm(between - start, axis=1).max())
        else:
            off = float(np.linalg.norm(np.cross(between - start, way), axis=1).max()) / length
        if off > tolerance_m:
            kept.append(k - 1)
    if len(points) > 1:
        kept.append(len(points) - 1)
    return kept


def arrow(
    device_from_base: Pose, size_m: tuple[float, float, float], *, colour: Colour
) -> dict[str, Solid]:
    """Return an arrow along +x whose base's middle is a frame's origin: a shaft and two barbs."""
    length, width, height = size_m
    middle = np.array([0.0, 0.0, 0.5 * height])
    ahead, aside = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    tip, tail = middle + 0.5 * length * ahead, middle - 0.5 * length * ahead
    thick = max(HEAD_WIDTH * min(width, height), 0.01)
    back = tip - HEAD_SHARE * length * ahead
    parts = {"shaft": (tail, tip)}
    for name, side in (("left", 0.5), ("right", -0.5)):
        parts[name] = (back + side * width * aside, tip)
    found: dict[str, Solid] = {}
    for name, (start, end) in parts.items():
        made = rod(device_from_base @ start, device_from_base @ end, width_m=thick, colour=colour)
        if made is not None:
            found[name] = made
    return found
