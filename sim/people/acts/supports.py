"""Supports at a place, to stand or sit on: the room's surfaces and other objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from sim.bodies import UNIT_BOX_CORNERS
from sim.people.person import Person

HIGHEST_M = 1.3
"""Height up to which people put objects: their shoulders."""
HIGHEST_SEAT_M = 0.65
"""Height up to which people sit on something."""
EDGE_M = 0.005
"""How far inside a part's outline a place has to lie to be carried by it."""


def support_at(
    person: Person,
    place: tuple[float, float],
    *,
    without: str | None = None,
    highest_m: float = HIGHEST_M,
) -> float:
    """Height of the highest surface at a place, of the room or of an object, metres.

    Args:
        person: who asks.
        place: (x, y).
        without: an object that does not count.
        highest_m: surfaces above it do not count.
    """
    physics = person.physics
    best = physics.support_height(np.array([*place, highest_m]))
    for item in person.room.objects:
        if item.object_id != without and person.held_hand(item.object_id) is None:
            pose = physics.object_pose(item.object_id)
            tops = [top for top in tops_at(item, pose, place) if top <= highest_m]
            best = max(best, *tops) if tops else best
    return best


def tops_at(
    item: PhysicalObject, world_from_object: Pose, place: tuple[float, float]
) -> Sequence[float]:
    """World heights of the tops of an upright object's parts that lie under a place (x, y)."""
    x, y, _ = world_from_object.inverse() @ np.array([*place, world_from_object.translation[2]])
    tops: list[float] = []
    for part in item.parts:
        corners = part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m))
        low, high = corners.min(axis=0) + EDGE_M, corners.max(axis=0) - EDGE_M
        if low[0] < x < high[0] and low[1] < y < high[1]:
            tops.append(float(world_from_object.translation[2] + high[2] + EDGE_M))
    return tops
