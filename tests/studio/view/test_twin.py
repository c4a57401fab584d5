"""What the twin shows where its scan has a hole."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from studio.view.twin import BACKGROUND, Twin, usual_colour

ORANGE = np.array([0.9, 0.5, 0.2])
SIDE_PX = 64
INSIDE, UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.5, 3.0])


def floor_of(colour):
    """A floor of splats at z = 0, and one splat under the ceiling that is not there."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-2, 2, 21), np.linspace(-2, 2, 21)))
    means = np.append(np.column_stack([x, y, np.zeros_like(x)]), [[1.9, 1.9, 2.5]], axis=0)
    count = len(means)
    harmonics = np.tile((np.asarray(colour) - 0.5) / 0.28209479, (count, 1, 1))
    return SplatCloud(
        means=means.astype(np.float32),
        scales=np.full((count, 3), 0.1, np.float32),
        rotations=np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        opacities=np.full(count, 0.9, np.float32),
        sh=harmonics.astype(np.float32),
    )


@pytest.fixture(scope="module")
def twin():
    footprint = np.array([[-2.0, -2.0], [2.0, 2.0]])
    scene = SimpleNamespace(room=floor_of(ORANGE), objects=(), footprint_m=footprint)
    return Twin(scene, NativeRenderer())


def seen(twin, camera, eye):
    return twin.picture({}, camera, look_at(eye, eye + UP)) / 255.0


def test_a_hole_in_the_ceiling_has_the_room_s_usual_colour(twin):
    picture = seen(twin, Pinhole.from_fov(SIDE_PX, SIDE_PX, 0.6), INSIDE)
    np.testing.assert_allclose(picture[SIDE_PX // 2, SIDE_PX // 2], ORANGE, atol=0.01)


@pytest.mark.parametrize("eye", [np.array([5.0, 0.0, 1.0]), np.array([0.0, 0.0, 8.0])])
def test_outside_the_room_nothing_is_behind_it(twin, eye):
    picture = seen(twin, Pinhole.from_fov(SIDE_PX, SIDE_PX, 0.6), eye)
    np.testing.assert_allclose(picture[0, 0], BACKGROUND, atol=0.01)


def test_beside_a_lens_s_circle_nothing_is_drawn(twin):
    picture = seen(twin, Fisheye.from_fov(SIDE_PX, math.radians(180)), INSIDE)
    np.testing.assert_allclose(picture[0, 0], BACKGROUND, atol=0.01)
    np.testing.assert_allclose(picture[SIDE_PX // 2, SIDE_PX // 2], ORANGE, atol=0.01)


def test_a_room_without_splats_has_no_colour_of_its_own():
    assert usual_colour(floor_of(ORANGE).select(np.zeros(0, np.intp))) == BACKGROUND
