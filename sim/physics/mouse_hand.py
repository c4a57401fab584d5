"""A hand that a user moves with the mouse: it grips one object and pulls it by a spring."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from sim.physics.engine import mujoco
from sim.physics.moving.people import HAND_FORCE_LIMIT_N

PULL_RAD_PER_S = 12.0
"""Natural frequency of the pull, critically damped: the object is within 5 % of its way after
4.7 / 12 s = 0.4 s. Half of it lags behind a mouse visibly, twice of it jerks."""
HOLD_RAD_PER_S = 20.0
"""Natural frequency with which the grip keeps the object's attitude, critically damped."""
LONGEST_STRETCH_M = 0.8
"""Stretch of the spring above which it pulls no harder: the object then moves at
12 · 0.8 / 2 = 4.8 m/s, as fast as something is thrown by hand, and slow enough for any wall."""
PULL_LIMIT_N = 2.0 * HAND_FORCE_LIMIT_N
"""Most force of the pull: of two of the simulated people's hands."""
PULL_LIMIT_M_PER_S2 = 50.0
"""Most force of the pull on a light object, per kg: 5 g presses a book 1 mm into a wall."""
LIFT_LIMIT_N = HAND_FORCE_LIMIT_N
"""Weight up to which an object is carried, of one hand; what is heavier is dragged along."""
HOLD_LIMIT_NM = 30.0
"""Most torque of the grip: what two hands 0.3 m apart give with their forces."""
HOLD_LIMIT_RAD_PER_S2 = 300.0
"""Most torque on a light object, per kg·m²: half of it overshoots a turn of 45° visibly."""


class NotFree(KeyError):
    """An object is not there, or nothing can move it."""


@dataclass(slots=True)
class _Pull:
    """Grip on an object, its place and its goal; `held` (3, 3) is the attitude at first."""

    object_id: str
    point_in_object: NDArray[np.float64]
    target_in_world: NDArray[np.float64]
    held: NDArray[np.float64]
    turn_rad: float


class MouseHand:
    """At most one object is pulled at a time. `apply` has to be called before every step."""

    def __init__(self) -> None:
        self._pull: _Pull | None = None

    @property
    def object_id(self) -> str | None:
        """Id of the object that is pulled; None without one."""
        return None if self._pull is None else self._pull.object_id

    def pull(
        self,
        object_id: str,
        point_in_object: NDArray[np.float64],
        target_in_world: NDArray[np.float64],
        *,
        turn_rad: float,
        model: Any,
        data: Any,
    ) -> None:
        """Grip an object, or move the hand that grips it.

        Args:
            object_id: a free body; another one is released.
            point_in_object: (3,) metres, where it is gripped.
            target_in_world: (3,) metres, where that point is to be.
            turn_rad: about up, from the attitude that it was gripped in.
            model: of the body.
            data: of the body.

        Raises:
            NotFree: there is no such free body.
            ValueError: a number is not finite.
        """
        numbers = np.concatenate([point_in_object, target_in_world, [turn_rad]])
        if numbers.shape != (7,) or not np.isfinite(numbers).all():
            raise ValueError(f"pull of {object_id!r}: {numbers.tolist()}, wanted 7 finite numbers")
        body = free_body(model, object_id)
        if self._pull is None or self._pull.object_id != object_id:
            self.release(model, data)
            held = np.array(data.xmat[body]).reshape(3, 3)
            self._pull = _Pull(object_id, point_in_object, target_in_world, held, turn_rad)
        self._pull.point_in_object = np.array(point_in_object, dtype=np.float64)
        self._pull.target_in_world = np.array(target_in_world, dtype=np.float64)
        self._pull.turn_rad = turn_rad

    def release(self, model: Any, data: Any) -> str | None:
        """Let go: the object keeps its velocity, so it is thrown. Returns its id, if any."""
        object_id, self._pull = self.object_id, None
        if object_id is not None and is_free(model, object_id):
            data.xfrc_applied[model.body(object_id).id] = 0.0
        return object_id

    def apply(self, model: Any, data: Any) -> None:
        """Set force and torque for the next step; nothing if nothing is pulled."""
        pull = self._pull
        if pull is None:
            return
        if not is_free(model, pull.object_id):  # it was taken out of the model
            self._pull = None
            return
        body = int(model.body(pull.object_id).id)
        first = int(model.body_dofadr[body])
        rotation = np.array(data.xmat[body]).reshape(3, 3)
        spin = rotation @ data.qvel[first + 3 : first + 6]
        arm = rotation @ pull.point_in_object
        speed = data.qvel[first : first + 3] + np.cross(spin, arm)
        stretch = _bounded(pull.target_in_world - data.xpos[body] - arm, LONGEST_STRETCH_M)
        mass = float(model.body_mass[body])
        force = mass * (PULL_RAD_PER_S**2 * stretch - 2.0 * PULL_RAD_PER_S * speed)
        force = _bounded(force, min(PULL_LIMIT_N, PULL_LIMIT_M_PER_S2 * mass))
        weight = -mass * np.array(model.opt.gravity)
        if float(np.linalg.norm(weight)) <= LIFT_LIMIT_N:
            force = force + weight
        # The grip is a hand's: it gives a torque of its own, so the force acts at the centre of
        # mass and what is gripped by its edge is not swung around.
        data.xfrc_applied[body, :3] = force
        data.xfrc_applied[body, 3:] = self._torque(pull, rotation, spin, model=model, body=body)

    def _torque(
        self,
        pull: _Pull,
        rotation: NDArray[np.float64],
        spin: NDArray[np.float64],
        *,
        model: Any,
        body: int,
    ) -> NDArray[np.float64]:
        """(3,) N·m in the world that turn the object to the attitude it is held in."""
        wanted = Pose.from_yaw(pull.turn_rad).rotation @ pull.held
        error = rotation_vector(wanted @ rotation.T)
        inertia = float(np.array(model.body_inertia[body], dtype=np.float64).mean())
        torque = inertia * (HOLD_RAD_PER_S**2 * error - 2.0 * HOLD_RAD_PER_S * spin)
        return _bounded(torque, min(HOLD_LIMIT_NM, HOLD_LIMIT_RAD_PER_S2 * inertia))


def is_free(model: Any, object_id: str) -> bool:
    """Whether a body of that id is there and can move."""
    kind = int(mujoco.mjtObj.mjOBJ_JOINT)
    return int(mujoco.mj_name2id(model, kind, f"{object_id}:free")) >= 0


def free_body(model: Any, object_id: str) -> int:
    """Number of a free body.

    Raises:
        NotFree: there is none.
    """
    if not is_free(model, object_id):
        raise NotFree(f"{object_id!r}: no such object that can move")
    return int(model.body(object_id).id)


def push(
    object_id: str,
    point_in_world: NDArray[np.float64],
    impulse_ns: NDArray[np.float64],
    *,
    model: Any,
    data: Any,
) -> None:
    """Give a free object an impulse (3,), N·s, at a point (3,) of the world: a nudge.

    Raises:
        NotFree: there is no such free body.
        ValueError: a number is not finite.
    """
    if not np.isfinite([*point_in_world, *impulse_ns]).all():
        raise ValueError(f"push of {object_id!r}: {impulse_ns} N·s at {point_in_world}")
    body = free_body(model, object_id)
    first = int(model.body_dofadr[body])
    momentum = np.zeros(model.nv)
    mujoco.mj_applyFT(
        model, data, np.asarray(impulse_ns), np.zeros(3), np.asarray(point_in_world), body, momentum
    )
    change = np.zeros((1, model.nv))
    mujoco.mj_solveM(model, data, change, momentum[None])
    data.qvel[first : first + 6] += change[0, first : first + 6]


def rotation_vector(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) rotation vector in radians of a (3, 3) rotation."""
    quaternion, vector = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).reshape(9))
    mujoco.mju_quat2Vel(vector, quaternion, 1.0)
    return vector


def _bounded(vector: NDArray[np.float64], limit: float) -> NDArray[np.float64]:
    length = math.sqrt(float(vector @ vector))
    return vector if length <= limit else vector * (limit / length)
