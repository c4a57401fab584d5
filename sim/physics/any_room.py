"""The physics of any room, as people and rehearsals see it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.physics.moving.people import PersonTarget
from sim.physics.scanned.opening import twin_of_room
from sim.physics.world import World


class Physics(Protocol):
    """A room, its movable objects and the people in it."""

    @property
    def t_ns(self) -> int:
        """Simulated time since the start."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions and changes at the start, a sentence each."""
        ...

    def step(self, duration_ns: int) -> None:
        """Let `duration_ns` pass, in steps of 2 ms (a remainder is left out)."""
        ...

    def move_people(self, targets: Mapping[str, PersonTarget]) -> None:
        """Set what every named person wants from now on; a KeyError if a name is not known."""
        ...

    def object_pose(self, object_id: str) -> Pose:
        """`world_from_object` of one object."""
        ...

    def object_poses(self) -> dict[str, Pose]:
        """`world_from_object` of every object, by id."""
        ...

    def hand_position(self, person_id: str, hand: str) -> NDArray[np.float64]:
        """(3,) world metres: where a hand ("left" or "right") has really got to."""
        ...

    def support_height(self, position: NDArray[np.float64]) -> float:
        """Height of the highest level surface of the room at or below a point (3,), metres."""
        ...


def physics_of(room: PhysicalRoom, people: Mapping[str, PersonTarget]) -> Physics:
    """The physics of a room: of its solids, or of its scanned mesh where it has one.

    Args:
        room: what exists.
        people: where each person starts, by person id.

    Raises:
        ValueError: the scanned mesh is no room's.
    """
    return World(room, people) if room.collision is None else twin_of_room(room, people)
