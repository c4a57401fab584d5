"""Objects that a tracker moves, as kinematic bodies that push and carry what is free."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from sim.physics.collision.contact import TRACKED_BIT
from sim.physics.collision.grid import Array
from sim.physics.engine import mujoco

FASTEST_M_PER_S = 4.0
"""Speed above which a tracked object was found again elsewhere, not carried there."""
FASTEST_RAD_PER_S = 4.0 * math.pi
MIN_S = 1e-9
"""Time below which a motion is over; rounding leaves as much."""
CLEAR_M = 0.002
"""Distance from free objects at which something found again becomes solid."""


@dataclass(slots=True)
class _Motion:
    """Velocity of a body, metres and radians per second, for a time that is left."""

    linear: Array
    angular: Array
    left_s: float
    is_under_way: bool = False
    is_ghost: bool = False


class TrackedBodies:
    """The kinematic bodies of a model.

    Between two poses they move evenly, and their surfaces have that velocity, so what stands on
    them is taken along.

    Args:
        object_ids: names of mocap bodies.
        model: that has them.
        free: geoms that can be pushed.
    """

    def __init__(self, object_ids: tuple[str, ...], model: Any, free: NDArray[np.int64]) -> None:
        self._mocap = {name: int(model.body(name).mocapid[0]) for name in object_ids}
        self._geoms = {
            name: np.flatnonzero(model.geom_bodyid == model.body(name).id) for name in object_ids
        }
        self._free = free
        self._motions = {name: _Motion(np.zeros(3), np.zeros(3), 0.0) for name in object_ids}

    @property
    def is_moving(self) -> bool:
        """Whether any is under way or not yet solid."""
        return any(motion.is_under_way or motion.is_ghost for motion in self._motions.values())

    def aim(self, poses: Mapping[str, Pose], model: Any, data: Any, *, within_s: float) -> None:
        """Let some be at given poses `within_s` seconds from now.

        One that would have to move faster than `FASTEST_M_PER_S` is put there at once, and is
        solid as soon as it stands in no free object.

        Raises:
            KeyError: one of them isn't tracked.
            ValueError: no time is left.
        """
        if not within_s > 0.0:
            raise ValueError(f"tracked poses within {within_s} s: wanted more than 0 s")
        for name, pose in poses.items():
            mocap, motion = self._mocap[name], self._motions[name]
            linear = (pose.translation - data.mocap_pos[mocap]) / within_s
            angular = _rotation_between(data.mocap_quat[mocap], pose.quaternion()) / within_s
            is_found_again = (
                float(np.linalg.norm(linear)) > FASTEST_M_PER_S
                or float(np.linalg.norm(angular)) > FASTEST_RAD_PER_S
            )
            if is_found_again:
                data.mocap_pos[mocap], data.mocap_quat[mocap] = pose.translation, pose.quaternion()
                model.geom_contype[self._geoms[name]] = 0
                linear = angular = np.zeros(3)
            motion.linear, motion.angular = linear, angular
            motion.left_s = 0.0 if is_found_again else within_s
            motion.is_under_way = True
            motion.is_ghost = motion.is_ghost or is_found_again
            self._set_surface(name, model, data)
        mujoco.mj_kinematics(model, data)

    def advance(self, model: Any, data: Any, *, dt_s: float) -> None:
        """Move everything on by `dt_s`, before physics does."""
        for name, motion in self._motions.items():
            if motion.is_ghost and not self._overlaps(name, model, data):
                motion.is_ghost = False
                model.geom_contype[self._geoms[name]] = TRACKED_BIT
            if not motion.is_under_way:
                continue
            if motion.left_s <= 0.0:
                # A step later: until the next pose is due, what it carries goes on with it.
                motion.linear, motion.angular = np.zeros(3), np.zeros(3)
                motion.is_under_way = False
            share_s = min(dt_s, motion.left_s)
            mocap = self._mocap[name]
            data.mocap_pos[mocap] += share_s * motion.linear
            spin = _in_body(motion.angular, data.mocap_quat[mocap])
            mujoco.mju_quatIntegrate(data.mocap_quat[mocap], spin, share_s)
            motion.left_s = max(0.0, motion.left_s - share_s)
            if motion.left_s < MIN_S:
                motion.left_s = 0.0
            self._set_surface(name, model, data)

    def _set_surface(self, name: str, model: Any, data: Any) -> None:
        """Give the geoms the velocity of their body."""
        motion = self._motions[name]
        for geom in self._geoms[name].tolist():
            rotation = data.geom_xmat[geom].reshape(3, 3)
            arm = data.geom_xpos[geom] - data.mocap_pos[self._mocap[name]]
            model.geom_surfacevel[geom, :3] = (
                motion.linear + np.cross(motion.angular, arm)
            ) @ rotation
            model.geom_surfacevel[geom, 3:] = motion.angular @ rotation
        model.flg_surfacevel = bool(np.any(model.geom_surfacevel))

    def _overlaps(self, name: str, model: Any, data: Any) -> bool:
        """Whether one stands in a free object."""
        span = np.zeros(6)
        for geom in self._geoms[name].tolist():
            gap = np.linalg.norm(data.geom_xpos[self._free] - data.geom_xpos[geom], axis=1)
            near = gap < model.geom_rbound[self._free] + model.geom_rbound[geom] + CLEAR_M
            for other in self._free[near].tolist():
                if mujoco.mj_geomDistance(model, data, geom, other, CLEAR_M, span) < CLEAR_M:
                    return True
        return False


def _rotation_between(first: Array, second: Array) -> Array:
    """(3,) world rotation vector from one quaternion to another, the short way."""
    turn, vector, back = np.empty(4), np.empty(3), np.empty(4)
    mujoco.mju_negQuat(back, first)
    mujoco.mju_mulQuat(turn, second, back)
    mujoco.mju_quat2Vel(vector, turn, 1.0)
    return vector


def _in_body(vector: Array, quaternion: Array) -> Array:
    """A world vector in the body's frame."""
    back, turned = np.empty(4), np.empty(3)
    mujoco.mju_negQuat(back, quaternion)
    mujoco.mju_rotVecQuat(turned, vector, back)
    return turned
