"""The physics of the simulated room: what is pushed moves, and contact decides where it ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.physics.clear_place import place_clear
from sim.physics.collision.contact import (
    CONTACT_TIME_S,
    FLOOR_HALF_SIZE_M,
    ROOM_FRICTION,
    STATIC_BIT,
)
from sim.physics.engine import Spec, mujoco
from sim.physics.mouse_hand import MouseHand, free_body, push
from sim.physics.moving.air import set_drag
from sim.physics.moving.objects import add_object
from sim.physics.moving.people import People, PersonTarget
from sim.physics.moving.rest import carry_over, free_state, is_at_rest
from sim.physics.moving.virtual import Virtual, add_virtual

STEP_NS = 2_000_000
SUPPORT_GAP_M = 0.015


class World:
    """A MuJoCo model of a room, its objects and the people in it.

    Args:
        room: solids and objects.
        people: where each person starts, by person id.
        virtual: what exists in the physics alone.
        is_by_hand: whether objects are thrown: only the air slows them, and they do not get out
            over the walls. What people push is slowed as by joints that squeak (`DAMPING_PER_KG`).

    Raises:
        ValueError: an id appears twice.
    """

    def __init__(
        self,
        room: PhysicalRoom,
        people: Mapping[str, PersonTarget],
        *,
        virtual: Sequence[Virtual] = (),
        is_by_hand: bool = False,
    ) -> None:
        self.room = room
        self._is_by_hand = is_by_hand
        self._virtual = {item.object_id: item for item in virtual}
        if len(set(self.object_ids)) < len(room.objects) + len(virtual):
            raise ValueError(f"ids {sorted(self.object_ids)}: one is double")
        self._people = People(people)
        self._hand = MouseHand()
        self._compile()
        self._people.begin(self._model, self._data)
        mujoco.mj_forward(self._model, self._data)

    def _compile(self) -> None:
        """Build the model, with everything where it begins."""
        spec = mujoco.MjSpec()
        spec.option.timestep = STEP_NS * 1e-9
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 10.0
        spec.option.noslip_iterations = 3
        add_room(spec, self.room)
        if self._is_by_hand:
            close_room(spec, self.room)
        for item in self.room.objects:
            add_object(spec, item, item.world_from_object, is_damped=not self._is_by_hand)
        for solid in self._virtual.values():
            add_virtual(spec, solid, solid.world_from_object)
        is_held = [item.object_id for item in self.room.objects]
        is_held += [name for name, solid in self._virtual.items() if solid.mass_kg is not None]
        self._people.add_to(spec, is_held)
        self._model: Any = spec.compile()
        if self._is_by_hand:
            for body in range(self._model.nbody):
                set_drag(self._model, body)
        self._data: Any = mujoco.MjData(self._model)
        self._object_bodies = {name: int(self._model.body(name).id) for name in self.object_ids}

    def _recompile(self) -> None:
        """Build the model anew; everything goes on as it was."""
        before, time_s = free_state(self._model, self._data), self._data.time
        self._compile()
        carry_over(before, self._model, self._data)
        self._data.time = time_s
        self._people.resume(self._model, self._data)
        mujoco.mj_forward(self._model, self._data)

    @property
    def object_ids(self) -> tuple[str, ...]:
        """Everything that can move, and the virtual ones that cannot."""
        return (*(item.object_id for item in self.room.objects), *self._virtual)

    @property
    def t_ns(self) -> int:
        """Simulated time since the start."""
        return round(self._data.time / (STEP_NS * 1e-9)) * STEP_NS

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions and changes at the start: none, all of the room is known."""
        return ()

    def step(self, duration_ns: int) -> None:
        """Let `duration_ns` pass, in steps of 2 ms (a remainder is left out)."""
        for _ in range(duration_ns // STEP_NS):
            self._hand.apply(self._model, self._data)
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

    # --- by hand ---------------------------------------------------------------------------------

    @property
    def is_at_rest(self) -> bool:
        """Whether nothing moves, and nothing is pulled."""
        return self._hand.object_id is None and is_at_rest(self._model, self._data)

    def pull(
        self,
        object_id: str,
        point_in_object: NDArray[np.float64],
        target_in_world: NDArray[np.float64],
        *,
        turn_rad: float = 0.0,
    ) -> None:
        """See `MouseHand.pull`."""
        self._hand.pull(
            object_id, point_in_object, target_in_world,
            turn_rad=turn_rad, model=self._model, data=self._data,
        )  # fmt: skip

    def release(self) -> str | None:
        """See `MouseHand.release`."""
        return self._hand.release(self._model, self._data)

    def push(
        self, object_id: str, point_in_world: NDArray[np.float64], impulse_ns: NDArray[np.float64]
    ) -> None:
        """See `sim.physics.mouse_hand.push`."""
        push(object_id, point_in_world, impulse_ns, model=self._model, data=self._data)

    def throw(
        self,
        object_id: str,
        velocity: NDArray[np.float64],
        *,
        spin: NDArray[np.float64] | None = None,
    ) -> None:
        """Give a free object a velocity (3,), m/s, and a spin (3,) in its own frame, rad/s."""
        first = int(self._model.body_dofadr[free_body(self._model, object_id)])
        self._data.qvel[first : first + 3] = velocity
        self._data.qvel[first + 3 : first + 6] = 0.0 if spin is None else spin

    def place(self, object_id: str, world_from_object: Pose) -> Pose:
        """See `place_clear`."""
        return place_clear(object_id, world_from_object, model=self._model, data=self._data)

    def add_virtual(self, item: Virtual) -> None:
        """Add a virtual object; the model is compiled anew, and everything else goes on as it was.

        Raises:
            ValueError: its id is taken.
        """
        if item.object_id in self.object_ids:
            raise ValueError(f"virtual {item.object_id!r}: the id is taken")
        self._virtual[item.object_id] = item
        self._recompile()

    def remove_virtual(self, object_id: str) -> None:
        """Take a virtual object away.

        Raises:
            KeyError: no such virtual object.
        """
        del self._virtual[object_id]
        self._recompile()


OUTSIDE_M = 0.1
"""How far behind a room's walls it is closed: within their thickness, so nothing inside is met."""
MIN_HEIGHT_M = 2.0
"""Height at which a room without walls is closed."""


def add_room(spec: Spec, room: PhysicalRoom) -> None:
    """Add the floor (z = 0) and the solids of the room to a model."""
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[FLOOR_HALF_SIZE_M, FLOOR_HALF_SIZE_M, 0.1],
        friction=list(ROOM_FRICTION),
        solref=[CONTACT_TIME_S, 1.0],
        contype=STATIC_BIT,
        conaffinity=0,
    )
    for index, solid in enumerate(room.solids):
        pose = solid.object_from_box
        spec.worldbody.add_geom(
            name=f"solid-{index}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=list(solid.half_size_m),
            pos=pose.translation.tolist(),
            quat=pose.quaternion().tolist(),
            friction=list(ROOM_FRICTION),
            solref=[CONTACT_TIME_S, 1.0],
            contype=STATIC_BIT,
            conaffinity=0,
        )


def close_room(spec: Spec, room: PhysicalRoom) -> None:
    """Add planes behind the walls and at their upper edge, so that nothing thrown gets out."""
    tops = [float(s.object_from_box.translation[2]) + s.half_size_m[2] for s in room.solids]
    height = max([MIN_HEIGHT_M, *tops])
    (x0, y0), (x1, y1) = room.footprint_m.tolist()
    sides = {
        "ceiling": ([0.0, 0.0, height], [0.0, 0.0, -1.0]),
        "west": ([x0 - OUTSIDE_M, 0.0, 0.0], [1.0, 0.0, 0.0]),
        "east": ([x1 + OUTSIDE_M, 0.0, 0.0], [-1.0, 0.0, 0.0]),
        "south": ([0.0, y0 - OUTSIDE_M, 0.0], [0.0, 1.0, 0.0]),
        "north": ([0.0, y1 + OUTSIDE_M, 0.0], [0.0, -1.0, 0.0]),
    }
    for name, (place, inwards) in sides.items():
        spec.worldbody.add_geom(
            name=f"closed-{name}",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[FLOOR_HALF_SIZE_M, FLOOR_HALF_SIZE_M, 0.1],
            pos=place,
            zaxis=inwards,
            friction=list(ROOM_FRICTION),
            solref=[CONTACT_TIME_S, 1.0],
            contype=STATIC_BIT,
            conaffinity=0,
        )
