"""People in a model: a torso that stops nothing but is solid, and hands as balls on springs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from sim.physics.collision.contact import CONTACT_TIME_S, HAND_BIT, STATIC_BIT, TORSO_BIT
from sim.physics.engine import Spec, mujoco

HANDS = ("left", "right")
AXES = ("x", "y", "z", "yaw")
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


@dataclass(frozen=True, slots=True, eq=False)
class HandTarget:
    """Target of a hand.

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
    """Place of a person, and the targets of the hands.

    Attributes:
        position: (2,) of the feet on the floor, world metres.
        left: the left hand.
        right: the right hand.
        solid: whether the torso collides with objects now; it does not with what it sits on.
    """

    position: NDArray[np.float64]
    left: HandTarget
    right: HandTarget
    solid: bool = True


class People:
    """The bodies of people in one model.

    A hand is a ball of its own mass that follows its target by a spring of limited force
    (`HAND_FORCE_LIMIT_N`), so it pushes a chair but neither a wall nor a chair through a wall.

    Args:
        targets: where each person starts, by person id.
    """

    def __init__(self, targets: Mapping[str, PersonTarget]) -> None:
        self._targets = dict(targets)
        self._held: dict[tuple[str, str], str | None] = {
            (person_id, hand): None for person_id in targets for hand in HANDS
        }
        self._model: Any = None
        self._data: Any = None

    @property
    def targets(self) -> Mapping[str, PersonTarget]:
        """Targets of all people, by person id."""
        return self._targets

    def add_to(self, spec: Spec, object_ids: Sequence[str]) -> None:
        """Add everybody to a model that has these free objects, each of which a hand can hold."""
        for person_id, target in self._targets.items():
            _add_person(spec, person_id, target, object_ids)

    def begin(self, model: Any, data: Any) -> None:
        """Let the hands be where they are wanted, at rest; the model has been compiled."""
        self._model, self._data = model, data
        for person_id, target in self._targets.items():
            for hand, wanted in zip(HANDS, (target.left, target.right), strict=True):
                for axis, value in zip("xyz", wanted.position, strict=True):
                    data.joint(f"{person_id}:{hand}:{axis}").qpos[0] = value
        self.move(self._targets)

    def resume(self, model: Any, data: Any) -> None:
        """Go on in a model that was compiled anew: hands where they were, with what they hold."""
        before_model, before = self._model, self._data
        self._model, self._data = model, data
        held = dict(self._held)
        self._held = dict.fromkeys(held, None)
        for (person_id, hand), object_id in held.items():
            name = f"{person_id}:{hand}"
            for axis in AXES:
                was, now = before.joint(f"{name}:{axis}"), data.joint(f"{name}:{axis}")
                now.qpos[:], now.qvel[:] = was.qpos, was.qvel
            if object_id is None or not _has_weld(model, f"{name}:{object_id}"):
                continue
            weld = model.equality(f"{name}:{object_id}").id
            model.eq_data[weld] = before_model.eq_data[
                before_model.equality(f"{name}:{object_id}").id
            ]
            data.eq_active[weld] = 1
            self._held[person_id, hand] = object_id
        for person_id, target in self._targets.items():
            self._set_torso(person_id, target)
            for hand, wanted in zip(HANDS, (target.left, target.right), strict=True):
                self._set_springs(person_id, hand, wanted)

    def move(self, targets: Mapping[str, PersonTarget]) -> frozenset[str]:
        """Set what every named person wants from now on.

        Returns:
            Ids of the objects that a hand has taken or let go.

        Raises:
            KeyError: no such person, or a hand holds an object that isn't there or isn't free.
        """
        changed: set[str] = set()
        for person_id, target in targets.items():
            if person_id not in self._targets:
                raise KeyError(f"no person {person_id!r}; there are {sorted(self._targets)}")
            self._set_torso(person_id, target)
            for hand, wanted in zip(HANDS, (target.left, target.right), strict=True):
                self._set_springs(person_id, hand, wanted)
                changed |= self._set_hold(person_id, hand, wanted)
            self._targets[person_id] = target
        return frozenset(changed)

    def hand_position(self, person_id: str, hand: str) -> NDArray[np.float64]:
        """(3,) world metres: where a hand has really got to."""
        return self._data.xpos[self._model.body(f"{person_id}:{hand}").id].copy()

    def _set_torso(self, person_id: str, target: PersonTarget) -> None:
        body = self._model.body(f"{person_id}:torso")
        self._data.mocap_pos[body.mocapid[0], :2] = target.position
        self._model.geom_contype[body.geomadr[0]] = TORSO_BIT if target.solid else 0

    def _set_springs(self, person_id: str, hand: str, wanted: HandTarget) -> None:
        name = f"{person_id}:{hand}"
        for axis, value in zip("xyz", wanted.position, strict=True):
            self._data.actuator(f"{name}:{axis}").ctrl[0] = value
        self._data.actuator(f"{name}:yaw").ctrl[0] = wanted.yaw
        geom = self._model.geom(name).id
        solid = wanted.solid and wanted.holds is None
        self._model.geom_contype[geom] = HAND_BIT if solid else 0
        self._model.geom_conaffinity[geom] = STATIC_BIT if solid else 0

    def _set_hold(self, person_id: str, hand: str, wanted: HandTarget) -> set[str]:
        """Take and let go; ids of what was."""
        name, held = f"{person_id}:{hand}", self._held[person_id, hand]
        if held == wanted.holds:
            return set()
        if held is not None:
            self._data.eq_active[self._model.equality(f"{name}:{held}").id] = 0
        if wanted.holds is not None:
            self._grip(name, wanted.holds)
        self._held[person_id, hand] = wanted.holds
        return {object_id for object_id in (held, wanted.holds) if object_id is not None}

    def _grip(self, name: str, object_id: str) -> None:
        """Fix the object to the hand as it is now."""
        model, data = self._model, self._data
        mujoco.mj_kinematics(model, data)
        hand, item = model.body(name).id, model.body(object_id).id
        hand_from_world = Pose.from_quaternion(data.xquat[hand], data.xpos[hand]).inverse()
        hand_from_object = hand_from_world @ Pose.from_quaternion(data.xquat[item], data.xpos[item])
        equality = model.equality(f"{name}:{object_id}").id
        # A weld's numbers: anchor (3), relative pose (7), share of torque against force.
        model.eq_data[equality, :11] = [
            0.0, 0.0, 0.0, *hand_from_object.translation, *hand_from_object.quaternion(), 1.0,
        ]  # fmt: skip
        data.eq_active[equality] = 1


def _has_weld(model: Any, name: str) -> bool:
    return int(mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_EQUALITY), name)) >= 0


def _add_person(
    spec: Spec, person_id: str, target: PersonTarget, object_ids: Sequence[str]
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
        for object_id in object_ids:
            spec.add_equality(
                name=f"{person_id}:{hand}:{object_id}",
                type=mujoco.mjtEq.mjEQ_WELD,
                objtype=mujoco.mjtObj.mjOBJ_BODY,
                name1=f"{person_id}:{hand}",
                name2=object_id,
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
