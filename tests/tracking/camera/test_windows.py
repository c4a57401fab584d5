"""Displacements of windows between a drawing and a live picture that is shifted by a known turn."""

import math

import cv2
import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import Rendering
from tracking.camera.lens_view import FINE_F_PX, Sight
from tracking.camera.window_search import search_windows
from tracking.camera.window_slopes import by_slopes

LENS = Fisheye.from_fov(640, math.radians(200))
RNG = np.random.default_rng(7)
PATTERN = cv2.GaussianBlur(RNG.uniform(0, 1, (640, 640)).astype(np.float32), (0, 0), 2.5)
PATTERN = ((PATTERN - PATTERN.mean()) * 4 + 0.5).clip(0, 1)


class Wall:
    """Draws the pattern, 2 m away all over."""

    def __init__(self, pattern=PATTERN, alpha=1.0):
        self.pattern, self.alpha, self.sizes = pattern, alpha, []

    def render(self, objects, camera, world_from_camera, options=None):
        size = (camera.width_px, camera.height_px)
        self.sizes.append(size)
        grey = cv2.resize(self.pattern, size, interpolation=cv2.INTER_LINEAR)
        shape = grey.shape
        return Rendering(
            np.repeat(grey[..., None], 3, axis=2),
            np.full(shape, self.alpha, np.float32),
            np.full(shape, 2.0, np.float32),
        )


def sight(by_px, *, renderer=None, covered=0.0, gain=1.0):
    """The lens and a live picture of the pattern, shifted; its left part covered by something."""
    shift = np.array([[1, 0, by_px[0]], [0, 1, by_px[1]]], np.float32)
    live = cv2.warpAffine(PATTERN, shift, (640, 640), borderMode=cv2.BORDER_REFLECT) * gain
    wide = int(covered * 640)
    live[:, :wide] = cv2.GaussianBlur(RNG.uniform(0, 1, (640, wide + 1)), (0, 0), 2.5)[:, :wide]
    image = np.repeat((255 * live.clip(0, 1)).astype(np.uint8)[..., None], 3, axis=2)
    return Sight(LENS, Pose.identity(), image, (), renderer or Wall())


def middle(found):
    return np.median(found.shift, axis=0) * found.f_px


@pytest.mark.parametrize("by_px", [(0.0, 0.0), (2.0, -3.0), (-6.4, 5.7)])
def test_a_search_finds_windows_that_a_marker_put_pixels_away(by_px):
    found = search_windows(sight(by_px), Pose.identity())
    assert len(found.pixels) > 100
    np.testing.assert_allclose(middle(found), by_px, atol=0.15)
    assert found.share > 0.9


@pytest.mark.parametrize("by_px", [(0.0, 0.0), (0.3, -0.2), (-0.8, 0.6)])
def test_slopes_measure_what_is_left_to_a_tenth_in_another_exposure(by_px):
    found = by_slopes(sight(by_px, gain=0.8), Pose.identity(), blur_px=1.5)
    np.testing.assert_allclose(middle(found), by_px, atol=0.07)
    assert found.share > 0.9


def test_what_covers_the_room_is_not_found():
    found = by_slopes(sight((0.4, 0.0), covered=0.4), Pose.identity(), blur_px=1.0)
    assert 0.5 < found.share < 0.75
    assert np.mean(found.pixels[:, 0] < 0.36 * 640) < 0.05


def test_another_place_is_not_found():
    other = cv2.GaussianBlur(RNG.uniform(0, 1, (640, 640)).astype(np.float32), (0, 0), 2.5)
    elsewhere = sight((0, 0), renderer=Wall((other - other.mean()) * 4 + 0.5))
    assert search_windows(elsewhere, Pose.identity()).share < 0.1
    assert by_slopes(elsewhere, Pose.identity(), blur_px=1.0).share < 0.1


@pytest.mark.parametrize("wall", [Wall(alpha=0.5), Wall(np.full((640, 640), 0.5, np.float32))])
def test_where_nothing_is_known_or_to_be_seen_nothing_is_measured(wall):
    for found in (
        search_windows(sight((0, 0), renderer=wall), Pose.identity()),
        by_slopes(sight((0, 0), renderer=wall), Pose.identity(), blur_px=1.0),
    ):
        assert len(found.pixels) == 0
        assert found.share == 0.0


def test_a_small_lens_is_drawn_finer_than_it_is():
    wall = Wall()
    by_slopes(sight((0, 0), renderer=wall), Pose.identity(), blur_px=1.0)
    finer = round(FINE_F_PX / LENS.f_px)
    assert finer > 1
    assert wall.sizes == [(640 * finer, 640 * finer)]


def test_a_turn_and_a_shift_of_the_rig_move_windows_the_other_way():
    found = by_slopes(sight((0, 0)), Pose.identity(), blur_px=1.5)
    nearest = np.argmin(np.linalg.norm(found.pixels - 320, axis=1))
    # In the middle, turned to the right (about y, down) all goes left; shifted right likewise, by
    # the range.
    np.testing.assert_allclose(found.by_twist[nearest, 0, 1], -1.0, atol=0.01)
    np.testing.assert_allclose(found.by_twist[nearest, 0, 3], -0.5, atol=0.01)
