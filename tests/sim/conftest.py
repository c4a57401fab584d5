"""A small room of the tests' own: four walls, a table, a chair and a book."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.twin.scan_like import block, scan_like
from scenes.frames import look_at
from scenes.mesh import BoxPart, CollisionMesh, PhysicalObject, PhysicalRoom, TexturedMesh
from scenes.pose import Pose

RIG_POSITION = np.array([0.0, -0.5, 1.2])
TABLE_TOP_M = 0.72


def _box_mesh(low, high, colour, inward: bool = False) -> TexturedMesh:
    """An axis-aligned box of one colour; `inward` makes it a room."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    vertices = low + corners * (high - low)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))], dtype=np.int32)
    texture = np.full((4, 4, 3), colour, dtype=np.uint8)
    return TexturedMesh(
        vertices, faces[:, ::-1] if inward else faces, np.full((8, 2), 0.5, np.float32), texture
    )


def _box_part(low, high) -> BoxPart:
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    half_x, half_y, half_z = 0.5 * (high - low)
    return BoxPart(Pose(np.eye(3), 0.5 * (low + high)), (half_x, half_y, half_z))


def _object(object_id, boxes, colour, mass_kg, friction, world_from_object) -> PhysicalObject:
    meshes = tuple(_box_mesh(low, high, colour) for low, high in boxes)
    bounds = np.array([mesh.bounds() for mesh in meshes])
    x, y, z = bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)
    return PhysicalObject(
        object_id,
        object_id.split("-")[0],
        meshes,
        (float(x), float(y), float(z)),
        tuple(_box_part(low, high) for low, high in boxes),
        mass_kg,
        friction,
        world_from_object,
    )


@pytest.fixture(scope="session")
def box_mesh():
    """The function `box_mesh(low, high, colour, inward=False)`."""
    return _box_mesh


CHAIR_BOXES = [
    *(
        ((x - 0.02, y - 0.02, 0.0), (x + 0.02, y + 0.02, 0.43))
        for x in (-0.19, 0.19)
        for y in (-0.19, 0.19)
    ),
    ((-0.21, -0.21, 0.43), (0.21, 0.21, 0.47)),
    ((-0.21, -0.21, 0.47), (0.21, -0.17, 0.9)),
]


@pytest.fixture(scope="session")
def small_room() -> PhysicalRoom:
    table = ((1.1, 0.2, 0.0), (1.7, 1.2, TABLE_TOP_M))
    walls = [
        _box_part((-2.2, -2.2, 0), (-2.0, 2.2, 2.5)),
        _box_part((2.0, -2.2, 0), (2.2, 2.2, 2.5)),
        _box_part((-2.2, -2.2, 0), (2.2, -2.0, 2.5)),
        _box_part((-2.2, 2.0, 0), (2.2, 2.2, 2.5)),
    ]
    objects = (
        _object(
            "chair-1", CHAIR_BOXES, (120, 90, 60), 4.5, 0.45, Pose.from_yaw(0.3, (-0.6, 1.0, 0))
        ),
        _object(
            "book-1",
            [((-0.09, -0.125, 0.0), (0.09, 0.125, 0.03))],
            (180, 40, 40),
            0.8,
            0.5,
            Pose.from_yaw(0.2, (1.35, 0.6, TABLE_TOP_M)),
        ),
    )
    light = np.array([-0.6, 0.2, 0.77])
    return PhysicalRoom(
        name="small",
        static=(
            _box_mesh((-2, -2, 0), (2, 2, 2.5), (150, 150, 150), inward=True),
            _box_mesh(*table, (90, 110, 90)),
        ),
        objects=objects,
        solids=(*walls, _box_part(*table)),
        light_direction=light / np.linalg.norm(light),
        world_from_rig=look_at(RIG_POSITION, RIG_POSITION + np.array([0.0, 1.0, 0.0])),
        footprint_m=np.array([[-2.0, -2.0], [2.0, 2.0]]),
    )


def scanned(room: PhysicalRoom, triangles) -> PhysicalRoom:
    """The same objects in a room that is a mesh."""
    vertices = np.asarray(triangles, dtype=np.float32).reshape(-1, 3)
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    return replace(room, static=(), solids=(), collision=CollisionMesh(vertices, faces))


@pytest.fixture(scope="session")
def scanned_as():
    """The function `scanned(room, triangles)`."""
    return scanned


@pytest.fixture(scope="session")
def scanned_small_room(small_room) -> PhysicalRoom:
    """The small room as a headset scans it, without its objects."""
    walls = block((-2, -2, 0), (2, 2, 2.5), is_room=True)
    table = block((1.1, 0.2, 0), (1.7, 1.2, TABLE_TOP_M))
    triangles = scan_like(np.concatenate([walls, table]), edge_m=0.1, noise_m=0.002, seed=3)
    return scanned(small_room, triangles)
