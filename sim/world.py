"""The physics of the simulated room: what is pushed moves, and contact decides where it ends."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.collision.solids import add_room
from sim.engine import mujoco
from sim.objects import add_object
from sim.people.embodiment import People, PersonTarget

STEP_NS = 2_000_000
SUPPORT_GAP_M = 0.015


class World:
    """A MuJoCo model of a room, its objects and the people in it.

    Args:
        room: solids and objects.
        people: where each person starts, by person id.
    """

    def __init__(self, room: PhysicalRoom, people: Mapping[str, PersonTarget]) -> None:
        self.room = room
        spec = mujoco.MjSpec()
        spec.option.timestep = STEP_NS * 1e-9
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 10.0
        spec.option.noslip_iterations = 3
        add_room(spec, room)
        for item in room.objects:
            add_object(spec, item, item.world_from_object)
        self._people = People(people)
        self._people.add_to(spec, [item.object_id for item in room.objects])
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._object_bodies = {o.object_id: self._model.body(o.object_id).id for o in room.objects}
        self._people.begin(self._model, self._data)
        mujoco.mj_forward(self._model, self._data)

    @property
    def t_ns(self) -> int:
        """Simulated time since the start."""
        return round(self._data.time / (STEP_NS * 1e-9)) * STEP_NS

    @property
    def notes(self) -> tuple[str, ...]:
        """What had to be assumed or changed at the start: nothing, all of the room is known."""
        return ()

    def step(self, duration_ns: int) -> None:
        """Let `duration_ns` pass, in steps of 2 ms (a remainder is left out)."""
        for _ in range(duration_ns // STEP_NS):
            mujoco.mj_step(self._model, self._data)

    def move_people(self, targets: Mapping[str, PersonTarget]) -> None:
        """Set what every named person wants from now on.

        Raises:
            KeyError: no such person, or a hand holds an object that isn't there.
        """
        self._people.move(targets)

    def object_pose(self, object_id: str) -> Pose:
        """`world_from_object` of one object."""
        body = self._object_bodies[object_id]
        return Pose.from_quaternion(self._data.xquat[body], self._data.xpos[body])

    def object_poses(self) -> dict[str, Pose]:
        """`world_from_object` of every object, by id."""
        return {object_id: self.object_pose(object_id) for object_id in self._object_bodies}

    def hand_position(self, person_id: str, hand: str) -> NDArray[np.float64]:
        """(3,) world metres: where a hand has really got to."""
        return self._people.hand_position(person_id, hand)

    def support_height(self, position: NDArray[np.float64]) -> float:
        """Height of the highest level surface of the room at or below a point (3,), metres."""
        height = 0.0
        for solid in self.room.solids:
            local = solid.object_from_box.inverse() @ position
            inside = bool((np.abs(local[:2]) <= np.asarray(solid.half_size_m[:2])).all())
            top = float(solid.object_from_box.translation[2]) + solid.half_size_m[2]
            if inside and height < top <= position[2] + SUPPORT_GAP_M:
                height = top
        return height
