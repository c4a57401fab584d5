"""A scanned room of the tests' own: floor, walls of two colours, and a box that was cut out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from scenes.frames import look_at
from scenes.mesh import CollisionMesh
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.splats import SplatCloud, concatenate
from scenes.state import ObjectModel

BRIGHT, DARK, RED = (0.95, 0.95, 0.95), (0.1, 0.1, 0.1), (0.7, 0.2, 0.2)
HALF_M, HEIGHT_M, STEP_M = 1.5, 2.2, 0.1


def sheet(axis, at, low, high, colour, step_m=STEP_M) -> SplatCloud:
    """Flat splats a step apart on a rectangle across an axis."""
    lines = [np.arange(low[a] + step_m / 2, high[a], step_m) for a in range(3)]
    lines[axis] = np.array([at])
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    n = len(points)
    scales = np.full((n, 3), 0.7 * step_m)
    scales[:, axis] = 0.002
    sh = np.tile((np.asarray(colour, dtype=np.float32) - 0.5) / 0.2820948, (n, 1, 1))
    return SplatCloud(points, scales, np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.97), sh)


def room_splats() -> SplatCloud:
    """A room with one bright wall, at +x; all else is dark."""
    low, high = (-HALF_M, -HALF_M, 0.0), (HALF_M, HALF_M, HEIGHT_M)
    return concatenate(
        [
            sheet(2, 0.0, low, high, DARK),
            sheet(2, HEIGHT_M, low, high, DARK),
            sheet(0, -HALF_M, low, high, DARK),
            sheet(0, HALF_M, low, high, BRIGHT),
            sheet(1, -HALF_M, low, high, DARK),
            sheet(1, HALF_M, low, high, DARK),
        ]
    )


def box_splats(size_m=0.3) -> SplatCloud:
    """A red box that stands on its frame's origin."""
    half = 0.5 * size_m
    low, high = (-half, -half, 0.0), (half, half, size_m)
    faces = [
        sheet(axis, end[axis], low, high, RED, step_m=0.03)
        for axis in range(3)
        for end in (low, high)
    ]
    return concatenate(faces)


def box_mesh() -> CollisionMesh:
    """The room as triangles that look inwards."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 1)], dtype=float)
    vertices = corners * (HALF_M, HALF_M, HEIGHT_M)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return CollisionMesh(vertices.astype(np.float32), np.array(faces, dtype=np.int32))


@dataclass(frozen=True)
class Scan:
    """The scene, and its room and box as splats of another reconstruction."""

    scene: ScenePackage
    room: SplatCloud
    box: SplatCloud


def make_scan() -> Scan:
    """A new one."""
    box = ObjectModel(
        "box", "Box", "box", box_splats(), (0.3, 0.3, 0.3), 0.0, Pose.from_yaw(0.0, (0.0, 0.6, 0.0))
    )
    eye = np.array([0.0, -0.9, 1.3])
    scene = ScenePackage(
        name="cell",
        room=room_splats(),
        objects=(box,),
        codes=(),
        world_from_rig=look_at(eye, eye + np.array([0.0, 1.0, 0.0])),
        footprint_m=np.array([[-HALF_M, -HALF_M], [HALF_M, HALF_M]]),
        physical=None,
        collision=box_mesh(),
    )
    return Scan(scene, room_splats(), box_splats())


@pytest.fixture(scope="session")
def scan() -> Scan:
    return make_scan()
