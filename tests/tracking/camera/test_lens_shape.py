"""A lens's numbers: what they move, and lenses so changed."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.pose import Pose, rotation_from_vector
from tracking.camera.lens_shape import (
    NAMES,
    SHAPE,
    by_shape,
    circle_rays,
    reshaped,
    rms_px,
    shape_of,
    sigma_px,
)

LENS = Fisheye(960, 960, 270.0, 470.0, 488.0, math.radians(100), (0.02, 0.01, -0.004, 0.0))


@pytest.mark.parametrize("which", range(SHAPE))
def test_columns_are_the_derivatives_of_what_a_changed_lens_shows(which):
    rays = circle_rays(math.radians(99))
    change = np.zeros(SHAPE)
    change[which] = 1e-6
    pixels = LENS.project(rays)[0]
    moved = (reshaped(LENS, change).project(rays)[0] - pixels) / LENS.f_px / 1e-6
    np.testing.assert_allclose(by_shape(LENS, pixels)[:, :, which], moved, atol=1e-4)


def test_a_change_that_folds_the_picture_is_taken_in_part():
    change = np.array([0.0, -1.0, 0.0, 0.0, 0.0, 0.01, 0.0])
    lens = reshaped(LENS, change)
    assert 0 < lens.cx - LENS.cx < 0.01 * LENS.f_px
    with pytest.raises(ValueError, match="folds"):
        reshaped(LENS, 100.0 * change)


def test_lenses_apart_by_their_centres_are_so_many_pixels_apart():
    moved = reshaped(LENS, np.array([0, 0, 0, 0, 0, 3 / LENS.f_px, 4 / LENS.f_px]))
    assert rms_px(LENS, moved, max_angle=1.5) == pytest.approx(5.0)
    assert rms_px(LENS, LENS, max_angle=1.5) == 0.0


def test_a_centre_that_is_off_is_nearly_made_good_by_a_turn():
    moved = reshaped(LENS, np.array([0, 0, 0, 0, 0, 0.004, 0.0]))
    turn = Pose(rotation_from_vector(np.array([0.0, 0.004, 0.0])), np.zeros(3))
    alone = rms_px(moved, LENS, max_angle=1.5)
    assert rms_px(moved, LENS, max_angle=1.5, b_from_a=turn) < 0.5 * alone


def test_a_lens_is_as_uncertain_as_its_numbers():
    rng = np.random.default_rng(0)
    root = 1e-4 * rng.normal(size=(SHAPE, SHAPE))
    covariance = root @ root.T
    drawn = [reshaped(LENS, root @ rng.normal(size=SHAPE)) for _ in range(400)]
    spread = math.sqrt(np.mean([rms_px(LENS, lens, max_angle=1.6) ** 2 for lens in drawn]))
    assert sigma_px(LENS, covariance, max_angle=1.6) == pytest.approx(spread, rel=0.15)


def test_a_lens_of_its_own_numbers_is_itself():
    other = Fisheye(960, 960, 255.0, 481.0, 480.0, math.radians(100))
    back = reshaped(other, shape_of(LENS, other.f_px) - shape_of(other, other.f_px))
    assert rms_px(back, LENS, max_angle=math.radians(100)) < 1e-9


def test_an_equidistant_lens_has_no_distortion_among_its_numbers():
    numbers = shape_of(Fisheye(960, 960, 255.0, 0.0, 0.0, 1.7), 255.0)
    assert numbers[0] > 1.0
    np.testing.assert_allclose(numbers[1:], 0.0, atol=1e-10)


def test_every_number_has_a_name():
    assert len(set(NAMES)) == SHAPE
