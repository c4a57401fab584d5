"""A camera anywhere in a room: free, upright within limits, the same for the same generator."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.evaluate.filmed.camera_places import (
    CLEAR_M,
    HEIGHTS_M,
    LENS_ERROR,
    TILT_RAD,
    film_place,
    free_place,
)
from benchmarks.evaluate.filmed.conditions import Conditions
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.samples import sample_room

CONDITIONS = Conditions(lens_size_px=96)


@pytest.fixture(scope="module")
def desk():
    return sample_room("desk")


def test_places_are_inside_free_and_tilted_by_ten_degrees_at_most(desk):
    low, high = np.asarray(desk.footprint_m)
    up_in_rig = WORLD_FROM_FORWARD_CAMERA.rotation.T @ [0.0, 0.0, 1.0]
    poses = [free_place(desk, np.random.default_rng(k)) for k in range(60)]
    places = np.array([pose.translation for pose in poses])
    assert (places[:, :2] > low).all()
    assert (places[:, :2] < high).all()
    assert places[:, 2].min() >= HEIGHTS_M[0]
    assert places[:, 2].max() <= HEIGHTS_M[1]
    tilts = [math.acos(min(1.0, (pose.rotation @ up_in_rig)[2])) for pose in poses]
    assert 0.5 * TILT_RAD < max(tilts) <= TILT_RAD + 1e-6
    for solid in desk.solids:
        local = solid.object_from_box.inverse() @ places
        apart = np.maximum(np.abs(local) - np.asarray(solid.half_size_m), 0.0)
        assert np.linalg.norm(apart, axis=1).min() >= CLEAR_M


def test_a_full_room_is_refused(desk):
    low, high = np.asarray(desk.footprint_m)
    middle = desk.solids[0].object_from_box.translation
    wall = replace(desk.solids[0], half_size_m=(*(np.abs(high - low) + np.abs(middle[:2])), 9.0))
    with pytest.raises(ValueError, match="free on all sides"):
        free_place(replace(desk, solids=(wall,)), np.random.default_rng(0))


def test_the_same_generator_gives_the_same_picture_of_a_lens_that_is_not_quite_known(desk):
    first, second = (film_place(desk, CONDITIONS, np.random.default_rng(3)) for _ in range(2))
    assert len(first.frame.images) == 2
    for a, b in zip(first.frame.images, second.frame.images, strict=True):
        np.testing.assert_array_equal(a, b)
    assert first.frame.world_from_rig is None
    wrong = first.frame.rig.lenses[0].f_px / first.true_rig.lenses[0].f_px
    assert 0.0 < abs(wrong - 1.0) <= LENS_ERROR
    other = film_place(desk, CONDITIONS, np.random.default_rng(4))
    assert not np.array_equal(other.frame.images[0], first.frame.images[0])
