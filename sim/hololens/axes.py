"""The room's values as a HoloLens says them: its own world, y up, matrices for row vectors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.hololens.values import HandJoints
from devices.hololens.wire.spatial_input import HAND_JOINTS, JOINT_LAYOUT, SpatialInput, Valid
from scenes.frames import OPENGL_FROM_OPENCV, UNITY_FROM_WORLD, WORLD_FROM_GLTF
from scenes.pose import Pose, quaternion_from_rotation, rotation_from_quaternion
from sim.hololens.wearer import WornBody

Array = NDArray[np.float64]
Rows = NDArray[np.float32]

NOT_LOCATED: Rows = np.zeros((4, 4), np.float32)
"""Pose that is sent where the headset does not know where it is."""


def rows_of(pose: Pose) -> Rows:
    """Return a pose between two frames of the headset's axes as a matrix for row vectors."""
    return pose.matrix().T.astype(np.float32)


def surface_rows(world_from_surface: Pose) -> Rows:
    """Return where a surface is; its own axes are left as they are."""
    return rows_of(WORLD_FROM_GLTF.inverse() @ world_from_surface)


def camera_rows(world_from_camera: Pose) -> Rows:
    """Return where a camera of OpenCV axes is."""
    return rows_of(WORLD_FROM_GLTF.inverse() @ world_from_camera @ OPENGL_FROM_OPENCV.inverse())


def input_of(body: WornBody | None, world_from_room: Pose, before: SpatialInput) -> SpatialInput:
    """Return a sample of spatial input; what is not seen stays as it was before, not valid."""
    if body is None:
        return SpatialInput(Valid(0), before.head, before.eyes, before.left, before.right)
    turn = WORLD_FROM_GLTF.inverse() @ world_from_room
    head = turn @ body.world_from_head
    _right, down, ahead = head.rotation.T
    valid = Valid.HEAD
    eyes, left, right = before.eyes, before.left, before.right
    if body.gaze is not None:
        valid |= Valid.EYES
        places = (turn @ body.gaze.origin_m, turn.rotation @ body.gaze.direction)
        eyes = np.stack(places).astype(np.float32)
    if body.left is not None:
        valid, left = valid | Valid.LEFT, _hand(body.left, turn)
    if body.right is not None:
        valid, right = valid | Valid.RIGHT, _hand(body.right, turn)
    facing = np.stack([head.translation, ahead, -down]).astype(np.float32)
    return SpatialInput(valid, facing, eyes, left, right)


def nothing_seen() -> SpatialInput:
    """Return what a headset says before it has seen anything."""
    hand = np.zeros(HAND_JOINTS, JOINT_LAYOUT)
    zeros = np.zeros((3, 3), np.float32)
    return SpatialInput(Valid(0), zeros, zeros[:2], hand, hand)


def _hand(hand: HandJoints, turn: Pose) -> NDArray[np.void]:
    joints = np.zeros(HAND_JOINTS, JOINT_LAYOUT)
    for number, rotation in enumerate(hand.rotations):
        w, x, y, z = quaternion_from_rotation(turn.rotation @ rotation).tolist()
        joints["orientation"][number] = (x, y, z, w)
    joints["position"] = turn @ hand.positions_m
    joints["radius"] = hand.radii_m
    joints["accuracy"] = np.where(hand.is_exact, 0, 1)
    return joints


def from_unity(numbers: tuple[float, ...]) -> tuple[Pose, Array] | None:
    """Return the pose and scale of a display's ten numbers, z up; None where they are none."""
    values = np.array(numbers, dtype=np.float64)
    if not np.isfinite(values).all() or float(np.linalg.norm(values[3:7])) < 1e-6:
        return None
    u = UNITY_FROM_WORLD
    rotation = u.T @ rotation_from_quaternion(values[[6, 3, 4, 5]]) @ u
    return Pose(rotation, u.T @ values[:3]), u.T @ values[7:]
