"""Small motions of a pose as six numbers, and how they look from a camera.

A step is (x, y, z, rx, ry, rz): metres and radians along and about the world's axes, the turn about
the moved frame's own origin: the rotation goes to exp([r]ₓ) · rotation, the translation to itself
plus (x, y, z). A twist is the same motion in camera axes, the turn about the camera's centre:
p += shift + turn × p.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_vector

FloatArray = NDArray[np.float64]


def moved(world_from_object: Pose, step: FloatArray) -> Pose:
    """The pose after a step (6,)."""
    turn = rotation_from_vector(step[3:])
    return Pose(turn @ world_from_object.rotation, world_from_object.translation + step[:3])


def twists_of_object(world_from_camera: Pose, world_from_object: Pose) -> FloatArray:
    """(6, 6): row k is the twist (shift, turn) that a unit of the object's step k causes."""
    camera_from_world = world_from_camera.rotation.T
    twists = np.zeros((6, 6))
    twists[:3, :3] = camera_from_world.T
    turns = camera_from_world.T
    # The turn is about the object's origin: what it does at the camera's centre is taken back.
    x, y, z = camera_from_world @ (world_from_camera.translation - world_from_object.translation)
    twists[3:, :3] = turns @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    twists[3:, 3:] = turns
    return twists


def twists_of_camera(world_from_camera: Pose) -> FloatArray:
    """(6, 6): row k is the twist of everything seen that a unit of the camera's step k causes."""
    twists = np.zeros((6, 6))
    twists[:3, :3] = twists[3:, 3:] = -world_from_camera.rotation
    return twists
