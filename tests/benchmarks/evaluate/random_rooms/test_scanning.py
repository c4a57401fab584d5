"""A scan knows what a camera can see from outside, and no more."""

import numpy as np

from benchmarks.evaluate.random_rooms.scanning import without_hidden_faces
from scenes.mesh import PhysicalObject, TexturedMesh
from scenes.pose import Pose

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
FACES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))], dtype=np.int32)


def cube(half_m):
    texture = np.zeros((2, 2, 3), np.uint8)
    return TexturedMesh(half_m * CORNERS, FACES, np.zeros((8, 2), np.float32), texture)


def item(*meshes):
    return PhysicalObject("box", "box", meshes, (0.4, 0.4, 0.4), (), 1.0, 0.4, Pose.identity())


def test_the_outside_of_a_cube_stays_whole():
    assert len(without_hidden_faces(item(cube(0.2))).meshes[0].faces) == 12


def test_faces_inside_a_closed_part_are_in_no_scan():
    # Both cubes in one mesh, as an armchair's blocks stand in each other.
    outer, inner = cube(0.2), cube(0.1)
    both = TexturedMesh(
        np.concatenate([outer.vertices, inner.vertices]),
        np.concatenate([outer.faces, inner.faces + 8]),
        np.zeros((16, 2), np.float32),
        outer.texture,
    )
    left = without_hidden_faces(item(both)).meshes[0]
    assert np.array_equal(left.faces, outer.faces)
