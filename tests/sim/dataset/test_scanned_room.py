"""A room of a collision mesh and objects of solid boxes gets a sequence, and no photos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.mesh import CollisionMesh
from sim.dataset.truth.surfaces import meshes_of_room


def test_the_collision_mesh_stands_for_what_never_moves(small_room):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    mesh = CollisionMesh(vertices, np.array([[0, 1, 2]], np.int32))
    (found,) = meshes_of_room(replace(small_room, static=(), collision=mesh))
    np.testing.assert_array_equal(found.vertices, vertices)
    assert meshes_of_room(small_room) == small_room.static
