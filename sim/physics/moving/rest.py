"""How free bodies of a model move: at rest or not, and as they were in a model compiled anew."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.physics.engine import mujoco

RESTING_M_PER_S = 0.005
"""Speed below which an object is at rest: 0.1 mm from one picture of 60 Hz to the next."""
RESTING_RAD_PER_S = 0.02
"""Spin below which it is: as much at 5 mm from its axis, and 1° a second."""


def is_at_rest(model: Any, data: Any) -> bool:
    """Whether no free body moves; hands and torsos of people do not count."""
    for first in _free_dofs(model):
        speed = data.qvel[first : first + 6]
        if np.linalg.norm(speed[:3]) > RESTING_M_PER_S:
            return False
        if np.linalg.norm(speed[3:]) > RESTING_RAD_PER_S:
            return False
    return True


def free_state(model: Any, data: Any) -> dict[str, NDArray[np.float64]]:
    """(13,) place, quaternion and velocities of every free body, by the name of its joint."""
    state: dict[str, NDArray[np.float64]] = {}
    for joint in _free_joints(model):
        there = data.joint(joint)
        state[str(there.name)] = np.concatenate([there.qpos, there.qvel])
    return state


def carry_over(state: Mapping[str, NDArray[np.float64]], model: Any, data: Any) -> None:
    """Let free bodies that were there before go on as they were."""
    for joint in _free_joints(model):
        there = data.joint(joint)
        if str(there.name) in state:
            there.qpos[:], there.qvel[:] = np.split(state[str(there.name)], [7])


def _free_joints(model: Any) -> list[int]:
    return np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)).tolist()


def _free_dofs(model: Any) -> list[int]:
    return [int(model.jnt_dofadr[joint]) for joint in _free_joints(model)]
