import numpy as np
import pytest

from scenes.frames import WORLD_FROM_GLTF
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from scenes.prepare.headset_mesh import mirrored, place_mesh, register_mesh


def box(low, high):
    """The six faces of a box, two triangles each, fine enough to have corners everywhere."""
    low, high = np.array(low, float), np.array(high, float)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads]
    return low + corners * (high - low), np.array(faces)


@pytest.fixture(scope="module")
def room():
    """An oblong room with a cupboard and a table, so that no two headings look alike."""
    parts = [
        box((-3, -2, 0), (3, 2, 2.6)),
        box((1.8, 1.2, 0), (3, 2, 2.0)),
        box((-2.5, -1.5, 0), (-1.2, 0.1, 0.8)),
    ]
    vertices, faces, count = [], [], 0
    for v, f in parts:
        vertices.append(v)
        faces.append(f + count)
        count += len(v)
    return CollisionMesh(np.concatenate(vertices), np.concatenate(faces))


def moved(mesh, mesh_from_world):
    return CollisionMesh(mesh_from_world @ mesh.vertices.astype(np.float64), mesh.faces)


def test_a_mesh_is_put_back_from_a_near_guess(room):
    world_from_mesh = Pose.from_yaw(np.deg2rad(4.0), (0.08, -0.05, 0.03))
    fit = register_mesh(moved(room, world_from_mesh.inverse()), room, Pose.identity())
    left = fit.world_from_mesh @ world_from_mesh.inverse()
    assert np.linalg.norm(left.translation) < 0.005
    assert abs(left.yaw()) < np.deg2rad(0.2)
    assert fit.overlap > 0.95


@pytest.mark.parametrize("upright", [Pose.identity(), WORLD_FROM_GLTF])
@pytest.mark.parametrize("turn_deg", [0.0, 97.0, 200.0])
def test_a_mesh_is_placed_wherever_its_origin_is_and_whichever_axis_is_up(room, upright, turn_deg):
    world_from_mesh = Pose.from_yaw(np.deg2rad(turn_deg), (4.0, -7.0, 1.3)) @ upright
    placed, fit = place_mesh(moved(room, world_from_mesh.inverse()), room)
    assert np.linalg.norm(placed.vertices - room.vertices, axis=1).max() < 0.02
    assert fit.overlap > 0.95


def test_a_mirrored_mesh_is_turned_back_and_said_to_be(room):
    world_from_mesh = Pose.from_yaw(np.deg2rad(40.0), (1.0, 2.0, 0.4)) @ WORLD_FROM_GLTF
    placed, fit = place_mesh(mirrored(moved(room, world_from_mesh.inverse())), room)
    assert np.linalg.norm(placed.vertices - room.vertices, axis=1).max() < 0.02
    assert np.array_equal(placed.faces, room.faces)
    assert fit.is_mirrored
    assert "mirrored in its file" in fit.summary()


def test_a_mesh_that_fits_in_two_places_is_refused(room):
    shell = CollisionMesh(*box((-3, -2, 0), (3, 2, 2.6)))
    cupboard, faces = box((1.8, 1.2, 0), (3, 2, 2.0))
    one_corner = CollisionMesh(
        np.concatenate([shell.vertices, cupboard]), np.concatenate([shell.faces, faces + 8])
    )
    with pytest.raises(ValueError, match="fits the room in two places alike"):
        place_mesh(one_corner, shell)


def test_a_mesh_may_be_laid_either_way_where_that_makes_no_difference():
    shell = CollisionMesh(*box((-3, -2, 0), (3, 2, 2.6)))
    placed, fit = place_mesh(shell, shell)
    assert np.allclose(placed.vertices.min(axis=0), (-3, -2, 0), atol=0.02)
    assert fit.overlap > 0.95


def test_a_foreign_mesh_is_refused(room):
    far = CollisionMesh(room.vertices + 50.0, room.faces)
    with pytest.raises(ValueError, match="mesh of this room"):
        register_mesh(far, room, Pose.identity())


def test_a_mesh_in_centimetres_is_refused(room):
    with pytest.raises(ValueError, match="in metres"):
        place_mesh(CollisionMesh(100 * room.vertices, room.faces), room)


def test_an_empty_mesh_is_refused(room):
    empty = CollisionMesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    with pytest.raises(ValueError, match="headset's mesh has no triangles"):
        place_mesh(empty, room)
