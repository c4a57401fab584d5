"""A drawn object slid over what a window shows, without turning or scaling it."""

import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.frames import look_at
from scenes.pose import Pose
from tracking.solve.slide import (
    MIN_SHIFT_PX,
    STEEPEST_M,
    detail,
    shifted,
    silhouette_shift,
    slide,
    texture_shift,
)

SIDE = 120
CAMERA = Fisheye(SIDE, SIDE, 200.0, SIDE / 2, SIDE / 2, max_angle=math.radians(80))
WORLD_FROM_CAMERA = look_at(np.array([0.0, 0.0, 1.2]), np.array([0.0, 1.5, 0.1]))


def square(x, y, reach=18):
    """(SIDE, SIDE) 1 inside a square about a pixel."""
    picture = np.zeros((SIDE, SIDE), np.float32)
    picture[y - reach : y + reach, x - reach : x + reach] = 1.0
    return picture


def seen(own, *, hidden=None, live=None):
    hidden = np.zeros_like(own) if hidden is None else hidden
    return SimpleNamespace(
        own=own,
        foreground=own,
        hidden=hidden,
        live=live,
        camera=CAMERA,
        world_from_camera=WORLD_FROM_CAMERA,
    )


def drawn(alpha, rgb=None):
    return SimpleNamespace(alpha=alpha, rgb=rgb)


@pytest.fixture(scope="module")
def pattern():
    """(SIDE, SIDE, 3) coarse noise."""
    noise = np.random.default_rng(3).uniform(0, 1, (30, 30, 3)).astype(np.float32)
    return cv2.resize(noise, (SIDE, SIDE), interpolation=cv2.INTER_CUBIC).clip(0, 1)


@pytest.mark.parametrize("step", [(10, 0), (-8, 6), (0, -14)])
def test_a_silhouette_is_slid_to_where_the_object_s_pixels_are(step):
    alpha = square(60, 60)
    shift = silhouette_shift(seen(square(60 + step[0], 60 + step[1])), alpha)
    assert shift is not None
    np.testing.assert_allclose(shift, step, atol=2.0)


def test_a_silhouette_that_lies_well_is_left_alone():
    alpha = square(60, 60)
    assert silhouette_shift(seen(alpha), alpha) is None
    assert silhouette_shift(seen(square(61, 60)), alpha) is None
    assert math.hypot(1, 0) < MIN_SHIFT_PX


def test_what_is_hidden_speaks_neither_for_nor_against_a_place():
    alpha, half = square(60, 60), square(60, 60)
    half[:, :60] = 0.0
    covered = square(60, 60) - half
    assert silhouette_shift(seen(half, hidden=covered), alpha) is None


@pytest.mark.parametrize("step", [(7, 0), (-5, 9)])
def test_a_pattern_is_slid_onto_its_picture(pattern, step):
    alpha = square(60, 60)
    live = np.roll(pattern * alpha[..., None], step[::-1], axis=(0, 1)) + 0.3 * pattern[::-1]
    found = texture_shift(seen(alpha, live=live), drawn(alpha, pattern))
    assert found is not None
    shift, alike = found
    np.testing.assert_allclose(shift, step, atol=1.0)
    assert alike > 0.5


def test_nothing_drawn_is_slid_nowhere(pattern):
    empty = np.zeros((SIDE, SIDE), np.float32)
    assert texture_shift(seen(empty, live=pattern), drawn(empty, pattern)) is None


def test_details_are_what_is_finer_than_the_light(pattern):
    inside = square(60, 60) > 0.5
    flat = np.full((SIDE, SIDE, 3), 0.4, np.float32)
    assert np.abs(detail(flat, inside)[inside]).max() < 0.01
    fine = detail(pattern, inside)
    assert np.abs(fine[inside]).mean() > 0.02
    np.testing.assert_allclose(detail(pattern + 0.1, inside)[inside], fine[inside], atol=0.01)
    assert not fine[~inside].any()


def standing():
    return Pose.from_yaw(0.4, (0.1, 1.5, 0.0))


def pixel_of(point):
    return CAMERA.project((WORLD_FROM_CAMERA.inverse() @ point)[None])[0][0]


@pytest.mark.parametrize("grounded", [True, False])
def test_a_slide_moves_the_object_by_so_many_pixels(grounded):
    model = SimpleNamespace(centre_at=lambda pose: pose @ np.array([0.0, 0.0, 0.1]))
    before, step = standing(), np.array([9.0, -4.0])
    after = shifted(before, step, seen(square(60, 60)), model, grounded=grounded)
    middle = (lambda pose: pose.translation) if grounded else model.centre_at
    np.testing.assert_allclose(pixel_of(middle(after)) - pixel_of(middle(before)), step, atol=0.01)
    np.testing.assert_array_equal(after.rotation, before.rotation)
    eye = WORLD_FROM_CAMERA.translation
    if grounded:
        assert after.translation[2] == pytest.approx(0.0, abs=1e-9)
    else:
        ranges = [np.linalg.norm(middle(pose) - eye) for pose in (before, after)]
        assert ranges[0] == pytest.approx(ranges[1])


def test_no_slide_is_longer_than_a_person_would_swing_it():
    far = shifted(standing(), np.array([0.0, -55.0]), seen(square(60, 60)), None, grounded=True)
    apart = np.linalg.norm(far.translation - standing().translation)
    assert apart == pytest.approx(STEEPEST_M)


def test_a_plain_object_slides_by_its_outline_and_a_patterned_one_by_its_picture(pattern):
    before, alpha = standing(), square(60, 60)
    outline = square(72, 60)
    live = np.roll(pattern * alpha[..., None], (0, -8), axis=(0, 1)) + 0.3 * pattern[::-1]
    evidence = seen(outline, live=live)
    moved = {}
    for textured in (False, True):
        model = SimpleNamespace(textured=textured)
        after = slide(before, drawn(alpha, pattern), evidence, model, grounded=True)
        moved[textured] = pixel_of(after.translation)[0] - pixel_of(before.translation)[0]
    assert moved[False] == pytest.approx(12.0, abs=2.0)
    assert moved[True] == pytest.approx(-8.0, abs=1.0)
