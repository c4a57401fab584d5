import dataclasses

import numpy as np
import pytest

from scenes.frames import look_at
from scenes.pose import rotation_from_vector
from scenes.prepare.align.gravity import find_gravity, standing_world, up_from_cameras
from scenes.prepare.align.similarity import Similarity
from scenes.prepare.reconstruction import Reconstruction
from tests.scenes.prepare.align.printed import capture

TURNED = Similarity(0.4, rotation_from_vector([0.7, -1.1, 0.4]), np.array([1.0, 2.0, 3.0]))


def room(points):
    """Photos of a level camera, and points, in a frame that is not level."""
    level, _, truth = capture(np.random.default_rng(0), codes={}, frames=24, feature_px=0.1)
    views = truth.moved_reconstruction(level).views
    n = len(points)
    in_world = Reconstruction(views, points, np.zeros((n, 3), np.uint8), np.zeros(n, np.float32))
    return TURNED.moved_reconstruction(in_world)


def furnished(rng):
    """A floor, a larger table top, walls, and a few points below the floor (mirror pictures)."""
    floor = rng.uniform([-3, -2.5, -0.004], [3, 2.5, 0.004], (200, 3))
    table = rng.uniform([0, 0, 0.736], [1, 1, 0.744], (400, 3))
    walls = rng.uniform([-3, 2.49, 0], [3, 2.51, 2.7], (600, 3))
    below = rng.uniform([-3, -2.5, -1], [3, 2.5, -0.2], (12, 3))
    return np.concatenate([floor, table, walls, below])


def degrees_off(up):
    return np.degrees(np.arccos(np.clip(up @ TURNED.rotation[:, 2], -1, 1)))


def test_the_floor_is_found_below_a_larger_table():
    found = find_gravity(room(furnished(np.random.default_rng(1))), rng=np.random.default_rng(0))
    assert degrees_off(found.up) < 0.1
    on_floor = TURNED @ np.array([0.3, -0.4, 0.0])
    assert abs(found.up @ on_floor - found.floor) / TURNED.scale < 0.003
    assert 150 < found.floor_points < 260
    assert found.tilt_sigma_deg < 0.1


def test_without_a_floor_up_comes_from_the_cameras_and_is_said_to():
    rng = np.random.default_rng(1)
    walls = rng.uniform([-3, 2.49, 0.2], [3, 2.51, 2.7], (600, 3))
    found = find_gravity(room(walls), rng=rng)
    assert found.floor_points == 0
    assert found.tilt_sigma_deg >= 3.0
    assert degrees_off(found.up) < 1.0


def test_photos_in_one_direction_still_have_a_top():
    reconstruction = room(np.zeros((0, 3)))
    one = reconstruction.views[0]
    eye = np.array([0.0, 0.0, 1.5])
    same = TURNED.moved(look_at(eye, eye + np.array([1.0, 0.2, 0.0])))
    views = tuple(dataclasses.replace(one, name=str(k), world_from_camera=same) for k in range(3))
    assert degrees_off(up_from_cameras(dataclasses.replace(reconstruction, views=views))) < 0.5


def test_the_world_stands_on_the_floor():
    gravity = find_gravity(room(furnished(np.random.default_rng(1))), rng=np.random.default_rng(0))
    place = TURNED @ np.array([1.0, 2.0, 1.5])
    world = standing_world(gravity, place, TURNED.rotation[:, 1], 1 / TURNED.scale)
    np.testing.assert_allclose(world @ place, [0, 0, 1.5], atol=0.01)
    np.testing.assert_allclose(world @ (TURNED @ np.array([1.0, 3.0, 0.0])), [1, 0, 0], atol=0.01)


def test_no_views_no_up():
    none = np.zeros((0, 3))
    empty = Reconstruction((), none, none.astype(np.uint8), np.zeros(0, np.float32))
    with pytest.raises(ValueError, match="no views"):
        find_gravity(empty, rng=np.random.default_rng(0))
