"""The room's values as a HoloLens says them: its own world, y up, matrices for row vectors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.hololens.values import HandJoints
from devices.hololens.wire.spatial_input import HAND_JOINTS, JOINT_LAYOUT, SpatialInput, Valid
from scenes.frames import OPENGL_FROM_OPENCV, UNITY_FROM_WORLD, WORLD_FROM_GLTF
from scenes.pose import Pose, rotation_from_quaternion
from sim.hololens.wearer import WornBody

Array = NDArray[np.float64]
Rows = NDArray[np.float32]

NOT_LOCATED: Rows = np.zeros((4, 4), np.float32)
"""Pose that is sent where the headset does not know where it is."""


def rows_of(a_from_b: Pose) -> Rows:
    """Return a pose between two frames of the headset's axes as a matrix for row vectors."""
    return a_from_b.matrix().T.astype(np.float32)


def surface_rows(world_from_surface: Pose) -> Rows:
    """Return where a surface is; its own axes are left as they are."""
    return rows_of(WORLD_FROM_GLTF.inverse() @ world_from_surface)


def camera_rows(world_from_camera: Pose) -> Rows:
    """Return where a camera of OpenCV axes is."""
    return rows_of(WORLD_FROM_GLTF.inverse() @ world_from_camera @ OPENGL_FROM_OPENCV.inverse())


def input_of(body: WornBody | None, world_from_room: Pose, *, before: SpatialInput) -> SpatialInput:
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
    joints["orientation"] = _quaternions(turn.rotation @ hand.rotations)
    joints["position"] = turn @ hand.positions_m
    joints["radius"] = hand.radii_m
    joints["accuracy"] = np.where(hand.is_exact, 0, 1)
    return joints


def _quaternions(rotations: Array) -> Array:
    """Return (N, 4) x y z w of (N, 3, 3): 60 hands a second want them all at once."""
    r = rotations
    xx, yy, zz = r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]
    x, y, z = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    xy, xz, yz = r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1]
    # Each row is the quaternion times four of one of its own numbers; the largest is exact.
    rows = np.array(
        [
            [1 + xx - yy - zz, xy, xz, x],
            [xy, 1 - xx + yy - zz, yz, y],
            [xz, yz, 1 - xx - yy + zz, z],
            [x, y, z, 1 + xx + yy + zz],
        ]
    )
    largest = np.argmax(np.diagonal(rows), axis=1)
    found = rows[largest, :, np.arange(len(r))]
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def from_unity(numbers: tuple[float, ...]) -> tuple[Pose, Array] | None:
    """Return the pose and scale of a display's ten numbers, z up; None where they are none."""
    values = np.array(numbers, dtype=np.float64)
    if not np.isfinite(values).all() or float(np.linalg.norm(values[3:7])) < 1e-6:
        return None
    u = UNITY_FROM_WORLD
    rotation = u.T @ rotation_from_quaternion(values[[6, 3, 4, 5]]) @ u
    return Pose(rotation, u.T @ values[:3]), u.T @ values[7:]
