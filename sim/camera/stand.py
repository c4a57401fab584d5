"""The stand under the 360° camera: a pole on three feet, seen at the lower rim of both lenses."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Rig
from scenes.mesh import TexturedMesh
from scenes.pose import Pose

GAP_BELOW_LENS_M = 0.13
POLE_RADIUS_M = 0.009
FOOT_LENGTH_M = 0.28
FOOT_RADIUS_M = 0.009
FOOT_RISE_M = 0.16
SIDES = 10


def camera_stand(world_from_rig: Pose, rig: Rig) -> TexturedMesh:
    """Pole and feet below the middle of the lenses, world coordinates, lit as static meshes are."""
    middle = np.mean([pose.translation for pose in rig.rig_from_lens], axis=0)
    x, y, z = world_from_rig @ middle
    foot = np.array([x, y, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    tubes = [_tube(foot + 0.05 * up, np.array([x, y, z - GAP_BELOW_LENS_M]), POLE_RADIUS_M)]
    for k in range(3):
        turn = 2.0 * math.pi * k / 3.0 + 0.4
        out = FOOT_LENGTH_M * np.array([math.cos(turn), math.sin(turn), 0.0])
        tubes.append(_tube(foot + FOOT_RISE_M * up, foot + out + FOOT_RADIUS_M * up, FOOT_RADIUS_M))
    vertices: list[NDArray[np.float64]] = []
    faces: list[NDArray[np.int32]] = []
    uv: list[NDArray[np.float32]] = []
    count = 0
    for tube_vertices, tube_faces, tube_uv in tubes:
        vertices.append(tube_vertices)
        faces.append(tube_faces + count)
        uv.append(tube_uv)
        count += len(tube_vertices)
    shade = np.linspace(38, 96, 16).astype(np.uint8)
    texture = np.broadcast_to(shade[None, :, None], (4, 16, 3))
    return TexturedMesh(
        np.concatenate(vertices), np.concatenate(faces), np.concatenate(uv), texture
    )


def _tube(
    start: NDArray[np.float64], end: NDArray[np.float64], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float32]]:
    axis = (end - start) / np.linalg.norm(end - start)
    helper = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    side = np.cross(axis, helper)
    side /= np.linalg.norm(side)
    up = np.cross(axis, side)
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = radius * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * up)
    vertices = np.concatenate([start + ring, end + ring, [start, end]])
    k = np.arange(SIDES)
    following = (k + 1) % SIDES
    faces = np.concatenate(
        [
            np.stack([k, following, k + SIDES], axis=1),
            np.stack([following, following + SIDES, k + SIDES], axis=1),
            np.stack([following, k, np.full(SIDES, 2 * SIDES)], axis=1),
            np.stack([k + SIDES, following + SIDES, np.full(SIDES, 2 * SIDES + 1)], axis=1),
        ]
    )
    across = 0.5 + 0.45 * np.cos(turn)
    uv = np.zeros((len(vertices), 2))
    uv[:, 0] = np.concatenate([across, across, [0.1, 0.9]])
    uv[:, 1] = 0.5
    return vertices, faces.astype(np.int32), uv.astype(np.float32)
