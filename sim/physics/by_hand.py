"""The physics of a room that a user reaches into with the mouse, whichever kind of room it is."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.samples import sample_room
from sim.physics.any_room import Physics
from sim.physics.moving.virtual import Virtual
from sim.physics.scanned.objects import only_scanned, with_scanned
from sim.physics.scanned.opening import twin_of_package
from sim.physics.world import World


class PhysicsByHand(Physics, Protocol):
    """A running room in which a user grips, pulls, pushes, throws and places objects."""

    @property
    def object_ids(self) -> tuple[str, ...]:
        """Objects, and what is virtual."""
        ...

    @property
    def is_at_rest(self) -> bool:
        """Whether nothing moves, and nothing is pulled."""
        ...

    def pull(
        self,
        object_id: str,
        point_in_object: NDArray[np.float64],
        target_in_world: NDArray[np.float64],
        *,
        turn_rad: float = 0.0,
    ) -> None:
        """Grip an object at a point of it (3,), and pull that point to one of the world (3,).

        Again with the same object, the hand moves; see `sim.physics.mouse_hand.MouseHand.pull`.
        """
        ...

    def release(self) -> str | None:
        """Let go of what is pulled: it keeps its velocity. Returns its id, if any."""
        ...

    def push(
        self, object_id: str, point_in_world: NDArray[np.float64], impulse_ns: NDArray[np.float64]
    ) -> None:
        """Nudge an object at a point (3,) of the world by an impulse (3,), N·s."""
        ...

    def throw(
        self,
        object_id: str,
        velocity: NDArray[np.float64],
        *,
        spin: NDArray[np.float64] | None = None,
    ) -> None:
        """Give an object a velocity (3,), m/s, and a spin (3,) in its own frame, rad/s."""
        ...

    def place(self, object_id: str, world_from_object: Pose) -> Pose:
        """Put an object somewhere, at rest and out of what stands there; returns where it is."""
        ...

    def add_virtual(self, item: Virtual) -> None:
        """Add a virtual object while everything else goes on; a ValueError if its id is taken."""
        ...

    def remove_virtual(self, object_id: str) -> None:
        """Take a virtual object away; a KeyError if there is none of that id."""
        ...


def physics_by_hand(scene: ScenePackage) -> PhysicsByHand:
    """The physics of a scene: of the built-in room it is a scan of, or of its collision mesh.

    Objects begin where the scan has them. In a built-in room nothing can leave over the walls.

    Args:
        scene: what is shown.

    Raises:
        ValueError: it has neither, or its collision mesh is no room's; the message says what to do.
    """
    if scene.physical is None:
        if scene.collision is None:
            raise ValueError(
                f"scene {scene.name!r} has no collision mesh, so nothing would stop what is moved: "
                "prepare the room from its photos, or open a prepared one"
            )
        return twin_of_package(scene)
    room = sample_room(scene.physical)
    room = with_scanned(room, only_scanned(room, scene))
    places = {item.object_id: item.world_from_object for item in scene.objects}
    objects = tuple(
        replace(item, world_from_object=places[item.object_id])
        for item in room.objects
        if item.object_id in places
    )
    return World(replace(room, objects=objects), {}, is_by_hand=True)
