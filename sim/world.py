"""The physics of the simulated room: what is pushed moves, and contact decides where it ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from sim.collision.contact import CONTACT_TIME_S, HAND_BIT, STATIC_BIT, TORSO_BIT
from sim.collision.solids import add_room
from sim.engine import Spec, mujoco
from sim.objects import add_object

STEP_NS = 2_000_000
HANDS = ("left", "right")
HAND_RADIUS_M = 0.045
HAND_MASS_KG = 1.2
HAND_STIFFNESS_N_PER_M = 5000.0
HAND_DAMPING_NS_PER_M = 155.0
HAND_FORCE_LIMIT_N = 90.0
HAND_YAW_STIFFNESS_NM = 60.0
HAND_YAW_DAMPING_NMS = 2.0
HAND_YAW_INERTIA = 0.01
HAND_FRICTION = (1.5, 0.02, 0.0001)
TORSO_RADIUS_M = 0.17
TORSO_LOW_M = 0.75
TORSO_HIGH_M = 1.45
SUPPORT_GAP_M = 0.015


@dataclass(frozen=True, slots=True, eq=False)
class HandTarget:
    """Where a person wants a hand to be.

    Attributes:
        position: (3,) world metres.
        yaw: about up, radians; turns what is held.
        solid: whether it collides with objects now.
        holds: id of the object it grips, or None.
    """

    position: NDArray[np.float64]
    yaw: float = 0.0
    solid: bool = False
    holds: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PersonTarget:
    """Where a person is and wants the hands to be.

    Attributes:
        position: (2,) of the feet on the floor, world metres.
        left: the left hand.
        right: the right hand.
    """

    position: NDArray[np.float64]
    left: HandTarget
    right: HandTarget


class World:
    """A MuJoCo model of a room, its objects and the people in it.

    A hand is a ball of its own mass that follows its target by a spring of limited force
    (`HAND_FORCE_LIMIT_N`), so it pushes a chair but neither a wall nor a chair through a wall.

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
        for person_id, target in people.items():
            _add_person(spec, person_id, target, room.objects)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._people = tuple(people)
        self._object_bodies = {o.object_id: self._model.body(o.object_id).id for o in room.objects}
        self._held: dict[tuple[str, str], str | None] = {
            (person_id, hand): None for person_id in people for hand in HANDS
        }
        for person_id, target in people.items():
            for hand, wanted in zip(HANDS, (target.left, target.right), strict=True):
                for axis, value in zip("xyz", wanted.position, strict=True):
                    self._data.joint(f"{person_id}:{hand}:{axis}").qpos[0] = value
        self.move_people(people)
        mujoco.mj_forward(self._model, self._data)

    @property
    def t_ns(self) -> int:
        """Simulated time since the start."""
        return round(self._data.time / (STEP_NS * 1e-9)) * STEP_NS

    def step(self, duration_ns: int) -> None:
        """Let `duration_ns` pass, in steps of 2 ms (a remainder is left out)."""
        for _ in range(duration_ns // STEP_NS):
            mujoco.mj_step(self._model, self._data)

    def move_people(self, targets: Mapping[str, PersonTarget]) -> None:
        """Set what every named person wants from now on.

        Raises:
            KeyError: no such person, or a hand holds an object that isn't there.
        """
        for person_id, target in targets.items():
            mocap = self._model.body(f"{person_id}:torso").mocapid[0]
            self._data.mocap_pos[mocap, :2] = target.position
            for hand, wanted in zip(HANDS, (target.left, target.right), strict=True):
                self._set_hand(person_id, hand, wanted)

    def object_pose(self, object_id: str) -> Pose:
        """`world_from_object` of one object."""
        body = self._object_bodies[object_id]
        return Pose.from_quaternion(self._data.xquat[body], self._data.xpos[body])

    def object_poses(self) -> dict[str, Pose]:
        """`world_from_object` of every object, by id."""
        return {object_id: self.object_pose(object_id) for object_id in self._object_bodies}

    def hand_position(self, person_id: str, hand: str) -> NDArray[np.float64]:
        """(3,) world metres: where a hand has really got to."""
        return self._data.xpos[self._model.body(f"{person_id}:{hand}").id].copy()

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

    def _set_hand(self, person_id: str, hand: str, wanted: HandTarget) -> None:
        name = f"{person_id}:{hand}"
        for axis, value in zip("xyz", wanted.position, strict=True):
            self._data.actuator(f"{name}:{axis}").ctrl[0] = value
        self._data.actuator(f"{name}:yaw").ctrl[0] = wanted.yaw
        geom = self._model.geom(name).id
        solid = wanted.solid and wanted.holds is None
        self._model.geom_contype[geom] = HAND_BIT if solid else 0
        self._model.geom_conaffinity[geom] = STATIC_BIT if solid else 0
        held = self._held[person_id, hand]
        if held == wanted.holds:
            return
        if held is not None:
            self._data.eq_active[self._model.equality(f"{name}:{held}").id] = 0
        if wanted.holds is not None:
            self._grip(name, wanted.holds)
        self._held[person_id, hand] = wanted.holds

    def _grip(self, name: str, object_id: str) -> None:
        """Fix the object to the hand as it is now."""
        mujoco.mj_kinematics(self._model, self._data)
        hand = self._model.body(name).id
        hand_from_world = Pose.from_quaternion(
            self._data.xquat[hand], self._data.xpos[hand]
        ).inverse()
        hand_from_object = hand_from_world @ self.object_pose(object_id)
        equality = self._model.equality(f"{name}:{object_id}").id
        # A weld's numbers: anchor (3), relative pose (7), share of torque against force.
        self._model.eq_data[equality, :11] = [
            0.0, 0.0, 0.0, *hand_from_object.translation, *hand_from_object.quaternion(), 1.0,
        ]  # fmt: skip
        self._data.eq_active[equality] = 1


def _add_person(
    spec: Spec, person_id: str, target: PersonTarget, objects: Sequence[PhysicalObject]
) -> None:
    torso = spec.worldbody.add_body(
        name=f"{person_id}:torso", mocap=True, pos=[*target.position.tolist(), 0.0]
    )
    torso.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        size=[TORSO_RADIUS_M, 0.0, 0.0],
        fromto=[0.0, 0.0, TORSO_LOW_M, 0.0, 0.0, TORSO_HIGH_M],
        contype=TORSO_BIT,
        conaffinity=0,
    )
    for hand in HANDS:
        _add_hand(spec, f"{person_id}:{hand}")
        for item in objects:
            spec.add_equality(
                name=f"{person_id}:{hand}:{item.object_id}",
                type=mujoco.mjtEq.mjEQ_WELD,
                objtype=mujoco.mjtObj.mjOBJ_BODY,
                name1=f"{person_id}:{hand}",
                name2=item.object_id,
                active=False,
                solref=[2.0 * CONTACT_TIME_S, 1.0],
            )


def _add_hand(spec: Spec, name: str) -> None:
    body = spec.worldbody.add_body(
        name=name,
        gravcomp=1.0,
        mass=HAND_MASS_KG,
        inertia=[HAND_YAW_INERTIA] * 3,
        explicitinertial=True,
    )
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[HAND_RADIUS_M, 0.0, 0.0],
        friction=list(HAND_FRICTION),
        solref=[CONTACT_TIME_S, 1.0],
        mass=0.0,
        # A body whose geoms touch nothing when the model is compiled never will.
        contype=HAND_BIT,
        conaffinity=STATIC_BIT,
    )
    for axis in "xyz":
        joint = body.add_joint(
            name=f"{name}:{axis}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=[float(axis == other) for other in "xyz"],
        )
        actuator = spec.add_actuator(
            name=f"{name}:{axis}", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name
        )
        actuator.set_to_position(kp=HAND_STIFFNESS_N_PER_M, kv=HAND_DAMPING_NS_PER_M)
        actuator.forcelimited = True
        actuator.forcerange = [-HAND_FORCE_LIMIT_N, HAND_FORCE_LIMIT_N]
    joint = body.add_joint(
        name=f"{name}:yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0]
    )
    actuator = spec.add_actuator(
        name=f"{name}:yaw", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name
    )
    actuator.set_to_position(kp=HAND_YAW_STIFFNESS_NM, kv=HAND_YAW_DAMPING_NMS)
