"""A room seen from outside: the walls and the ceiling between the eye and the room are left out.

From outside, a scan shows the backs of its walls, which hide everything. Like a doll's house, the
room is open towards whoever looks at it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.splats import SplatCloud

LAYER_M = 0.10
"""Depth of a side, metres: a wall's splats with the scan's noise, skirting boards, pictures on it.
With 0.25 m the backs of furniture that stands at a wall go with it."""

FLOOR_M = 0.05
"""Height up to which splats are the floor's, which stays, metres: the scan's noise and a carpet."""

CELL_M = 0.25
"""Side of the cells by which a side's cover is measured, metres."""

CLOSED_SHARE = 0.5
"""Share of a side's cells with splats from which it is a wall or ceiling: rails, lamps and the tops
of cupboards cover less than a quarter, walls with windows and doors more than two thirds."""

Side = tuple[int, bool]
"""Axis 0 to 2, and whether it is the far end of it."""


@dataclass(frozen=True, slots=True, eq=False)
class RoomSides:
    """The closed sides of a room.

    Attributes:
        low_m: (3,) corner of the room.
        high_m: (3,) the opposite one.
        closed: its sides with a wall or a ceiling; the floor never counts.
    """

    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    closed: frozenset[Side]

    def hiding(self, eye_m: NDArray[np.float64]) -> frozenset[Side]:
        """Closed sides that lie between an eye and the room."""
        return frozenset(
            (axis, is_far)
            for axis, is_far in self.closed
            if (eye_m[axis] > self.high_m[axis] if is_far else eye_m[axis] < self.low_m[axis])
        )

    def without(self, room: SplatCloud, sides: frozenset[Side]) -> SplatCloud:
        """The room without the splats of some sides."""
        keep = np.ones(len(room), dtype=bool)
        for side in sides:
            keep &= ~self._of_side(room.means, side)
        return room.select(keep)

    def _of_side(self, means: NDArray[np.float32], side: Side) -> NDArray[np.bool_]:
        axis, is_far = side
        if is_far:
            beyond = means[:, axis] > self.high_m[axis] - LAYER_M
        else:
            beyond = means[:, axis] < self.low_m[axis] + LAYER_M
        return beyond & (means[:, 2] > FLOOR_M)


def room_sides(room: SplatCloud, footprint_m: NDArray[np.float64]) -> RoomSides:
    """Return the sides of a room that are closed.

    Args:
        room: world metres, Z up, the floor at 0.
        footprint_m: (2, 2) the floor's opposite corners.
    """
    top_m = float(np.percentile(room.means[:, 2], 99.5)) if len(room) else 0.0
    low, high = footprint_m.min(axis=0), footprint_m.max(axis=0)
    sides = RoomSides(np.array([*low, 0.0]), np.array([*high, top_m]), frozenset())
    candidates = [(0, False), (0, True), (1, False), (1, True), (2, True)]
    closed = frozenset(side for side in candidates if _cover(room, sides, side) > CLOSED_SHARE)
    return RoomSides(sides.low_m, sides.high_m, closed)


def _cover(room: SplatCloud, sides: RoomSides, side: Side) -> float:
    """Share of a side's cells in which splats are."""
    axis, is_far = side
    across = [k for k in range(3) if k != axis]
    extent = (sides.high_m - sides.low_m)[across]
    cells = np.maximum(np.ceil(extent / CELL_M), 1).astype(int)
    means = room.means.astype(np.float64)
    at = sides.high_m[axis] if is_far else sides.low_m[axis]
    near = np.abs(means[:, axis] - at) < LAYER_M
    place = np.floor((means[near][:, across] - sides.low_m[across]) / CELL_M).astype(int)
    inside = ((place >= 0) & (place < cells)).all(axis=1)
    taken = np.zeros(cells, dtype=bool)
    taken[tuple(place[inside].T)] = True
    return float(taken.mean())
