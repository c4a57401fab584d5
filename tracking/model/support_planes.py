"""Support planes of a scanned room: where its splats lie flat at a height.

Objects stand on the floor or on a level surface in the scan, whether something stood there before
or not; at a table's height but beside the table, nothing stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import rotation_from_quaternion
from scenes.splats import SplatCloud
from scenes.state import ObjectModel

Points = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

CELL_M = 0.04
SURFACE_M = 0.03
"""Splats this near to a height are of a surface there."""

SOLID_OPACITY = 0.3
WIDEST_M = 0.12
"""Splats wider than this are no surface, but haze."""

GAP_M = 0.3
"""Width in m of gaps that are filled: an object stood there when the room was scanned."""


NARROW_M = 0.2
"""Width in m below which a surface is a wall seen from above or an edge."""


FLOOR_M = 0.0
EVERYWHERE_M = 0.1
"""The floor is everywhere, as far up as this."""

SAME_HEIGHT_M = 0.01
"""Supports nearer to each other than this are one."""

LEVEL = 0.95
"""Least vertical part of the normal of a splat that lies on a level surface: 18° off, what splats
of a trained scan scatter about their surface."""

HIGHEST_M = 1.6
"""Highest surface in m that people put objects on: shoulder height."""

MIN_SURFACE_M2 = 0.08
"""Smallest surface in m² that is a support plane of its own: a stool's seat."""

MAX_SURFACES = 8
"""Level surfaces looked at, those with most splats; a board has two, the lower of which is none."""


@dataclass(frozen=True, slots=True, eq=False)
class SupportPlanes:
    """Level surfaces of a room on which an object can stand.

    Attributes:
        heights_m: of the planes, ascending.
        corner_m: (2,) x and y of the maps' first cell's corner.
        maps: (H, Y, X) bool by height and cell of `CELL_M`.
    """

    heights_m: tuple[float, ...]
    corner_m: Points
    maps: BoolArray

    def can_hold(self, places: Points) -> BoolArray:
        """(N,) whether an object can stand at positions (N, 3) on one of the heights."""
        level = np.abs(places[:, 2:] - np.array(self.heights_m)).argmin(axis=1)
        cells = np.floor((places[:, :2] - self.corner_m) / CELL_M).astype(int)
        size = np.array(self.maps.shape[2:0:-1])
        inside = ((cells >= 0) & (cells < size)).all(axis=1)
        x, y = np.clip(cells, 0, size - 1).T
        return np.asarray(
            (places[:, 2] < EVERYWHERE_M) | (inside & self.maps[level, y, x]), dtype=np.bool_
        )


def support_planes_in(room: SplatCloud, objects: Sequence[ObjectModel]) -> SupportPlanes:
    """Support planes: the floor, where objects were scanned, and the room's level surfaces.

    Args:
        room: its splats without the movable objects.
        objects: each stood on a support plane where it was scanned.
    """
    widest = np.sort(room.scales, axis=1)[:, 2]
    is_solid = (room.opacities > SOLID_OPACITY) & (widest < WIDEST_M)
    solid = room.select(is_solid)
    means, reach = solid.means.astype(np.float64), widest[is_solid]
    stood_on = [FLOOR_M, *(item.support_z_m for item in objects)]
    heights = _distinct([*stood_on, *_level_surfaces(solid, reach, stood_on)])
    stood = np.array([item.world_from_object.translation[:2] for item in objects]).reshape(-1, 2)
    known = np.concatenate([stood, means[:, :2]])
    if len(known) == 0:
        return SupportPlanes(heights, np.zeros(2), np.zeros((len(heights), 1, 1), np.bool_))
    # A few stray splats hang outside every scan.
    low, high = np.percentile(known, [0.2, 99.8], axis=0)
    corner = np.minimum(low, stood.min(axis=0, initial=np.inf)) - GAP_M
    far = np.maximum(high, stood.max(axis=0, initial=-np.inf)) + GAP_M
    width, height = np.ceil((far - corner) / CELL_M).astype(int)
    maps = np.zeros((len(heights), int(height), int(width)), np.uint8)
    for level, z in enumerate(heights):
        at_height = np.abs(means[:, 2] - z) < SURFACE_M
        _paint(maps[level], means[at_height, :2] - corner, reach[at_height])
        maps[level] = cv2.morphologyEx(maps[level], cv2.MORPH_CLOSE, _disc(GAP_M))
        maps[level] = cv2.morphologyEx(maps[level], cv2.MORPH_OPEN, _disc(NARROW_M))
        here = [abs(item.support_z_m - z) < SAME_HEIGHT_M for item in objects]
        radii = np.array([0.5 * max(item.box_m[:2]) for item in objects])
        _paint(maps[level], stood[here] - corner, radii[here])
    return SupportPlanes(heights, corner, maps.astype(np.bool_))


def _level_surfaces(
    solid: SplatCloud, reach: NDArray[np.floating], known: Sequence[float]
) -> list[float]:
    """Heights of level surfaces that are not among the known ones, the largest first.

    Args:
        solid: the room's splats that belong to surfaces.
        reach: (N,) largest standard deviation of each, m.
        known: heights that are support planes anyway, m.
    """
    rotations = rotation_from_quaternion(solid.rotations.astype(np.float64))
    upright = np.abs(rotations[np.arange(len(solid)), 2, solid.scales.argmin(axis=1)])
    z = solid.means[:, 2].astype(np.float64)
    is_level = (upright > LEVEL) & (z > EVERYWHERE_M) & (z < HIGHEST_M)
    places, reach, z = solid.means[is_level, :2].astype(np.float64), reach[is_level], z[is_level]
    is_free = np.all([np.abs(z - height) > 2 * SURFACE_M for height in known], axis=0)
    found: list[float] = []
    while len(found) < MAX_SURFACES and is_free.any():
        here = np.sort(z[is_free])
        # The sheet that holds most of what is left.
        count = np.searchsorted(here, here + SAME_HEIGHT_M, side="right") - np.arange(len(here))
        first = int(count.argmax())
        height = float(np.median(here[first : first + count[first]]))
        at_height = is_free & (np.abs(z - height) < SAME_HEIGHT_M)
        is_free &= ~at_height
        area_m2 = CELL_M**2 * float(_surface(places[at_height], reach[at_height]).sum())
        if area_m2 >= MIN_SURFACE_M2:
            found.append(height)
        elif count[first] * CELL_M**2 < MIN_SURFACE_M2:
            break
    # The lower side of a board is no support: nothing fits between it and the upper side.
    return [z for z in found if not any(z < other < z + 2 * SURFACE_M for other in found)]


def _surface(places: Points, reach: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Cells of a surface of its own, without edges and walls seen from above."""
    corner = places.min(axis=0) - GAP_M
    width, height = np.ceil((places.max(axis=0) + GAP_M - corner) / CELL_M).astype(int)
    cells = np.zeros((int(height), int(width)), np.uint8)
    _paint(cells, places - corner, reach)
    # Between splats that are as far apart as they may be wide, there is surface.
    cells = cv2.morphologyEx(cells, cv2.MORPH_CLOSE, _disc(WIDEST_M))
    return np.asarray(cv2.morphologyEx(cells, cv2.MORPH_OPEN, _disc(NARROW_M)), dtype=np.uint8)


def _paint(cells: NDArray[np.uint8], places: Points, radii: NDArray[np.floating]) -> None:
    """Mark the cells within radii of places, both in metres."""
    for (x, y), radius in zip(np.floor(places / CELL_M).astype(int), radii, strict=True):
        cv2.circle(cells, (int(x), int(y)), int(radius / CELL_M), 1, cv2.FILLED)


def _disc(width_m: float) -> NDArray[np.uint8]:
    side = round(width_m / CELL_M) | 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    return np.asarray(disc, dtype=np.uint8)


def _distinct(heights_m: Sequence[float]) -> tuple[float, ...]:
    heights: list[float] = []
    for height in sorted(heights_m):
        if not heights or height - heights[-1] > SAME_HEIGHT_M:
            heights.append(height)
    return tuple(heights)
