"""True pictures of two cubes: which pixels judge one, what is behind it, sides nobody filmed."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.evaluate.cuts.cases import cases_of
from benchmarks.evaluate.cuts.true_views import GREY, MIN_SHOWN_PX, UNSEEN_DEG, TrueRoom
from scenes.pose import Pose
from scenes.render.native import NativeRenderer

FLOOR = np.array([150, 140, 120]) / 255
"""Colour of the floor in `conftest.py`."""


@pytest.fixture(scope="module")
def from_one_side(cubes):
    """The room with three photos of its twelve."""
    return replace(cubes, photos=cubes.photos[:3])


@pytest.fixture(scope="module")
def truth(from_one_side, cubes, cube_meshes):
    with TrueRoom(
        cube_meshes, from_one_side, aside=cubes.photos[3:4], true_from_package=Pose.identity()
    ) as room:
        yield room


def test_a_view_kept_aside_shows_the_object_and_what_is_behind_it(truth):
    (view,) = truth.aside_views(0)
    assert view.shown.sum() > MIN_SHOWN_PX
    assert view.rgb.shape == view.behind.shape == (*view.shown.shape, 3)
    red, _, blue = view.rgb[view.shown].mean(axis=0)
    assert red > 2 * blue
    red, _, blue = view.behind[view.shown].mean(axis=0)
    assert red < 1.5 * blue


def test_unseen_sides_are_far_from_every_photo_and_judged_by_what_photos_saw(
    cubes, from_one_side, truth
):
    middle = cubes.objects[0].middle
    photos = np.stack([v.world_from_camera.translation for v in from_one_side.photos]) - middle
    photos /= np.linalg.norm(photos, axis=1, keepdims=True)
    views = truth.unseen_views(0, cases_of(cubes)[0].truth.seen)
    assert views
    for view in views:
        towards = view.world_from_camera.translation - middle
        towards /= np.linalg.norm(towards)
        assert np.degrees(math.acos((photos @ towards).max())) >= UNSEEN_DEG - 0.1
        assert (view.behind == GREY).all()
        red, _, blue = view.rgb[view.shown].mean(axis=0)
        assert red > 2 * blue
    # Of a side that faces away from all three photos nothing was seen.
    assert any(view.shown.mean() < 0.7 for view in views)


def test_a_room_of_less_contrast_gets_the_same_colours(cubes, truth):
    room = cubes.package.room
    gain, bias = truth.colours(room, NativeRenderer()).T
    grey_gain, grey_bias = truth.colours(replace(room, sh=0.5 * room.sh), NativeRenderer()).T
    assert np.allclose(gain * FLOOR + bias, grey_gain * (0.5 * FLOOR + 0.25) + grey_bias, atol=0.05)
