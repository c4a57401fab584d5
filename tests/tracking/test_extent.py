"""What is drawn in the part of a picture that an object reaches is all there is of it."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.pose import Pose, rotation_from_vector
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud
from tracking.extent import extent, part_of

CAMERA = Fisheye.from_fov(300, math.radians(200))
OPTIONS = RenderOptions(threads=1, antialias=True)


def thing(rng):
    count = 60
    rotations = rng.normal(size=(count, 4))
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    return SplatCloud(
        rng.uniform(-0.3, 0.3, (count, 3)).astype(np.float32),
        rng.uniform(0.005, 0.08, (count, 3)).astype(np.float32),
        rotations.astype(np.float32),
        rng.uniform(0.3, 1.0, count).astype(np.float32),
        rng.uniform(0.0, 1.0, (count, 1, 3)).astype(np.float32),
    )


@pytest.mark.parametrize("seed", range(12))
def test_nothing_is_drawn_beside_the_extent(seed):
    rng = np.random.default_rng(seed)
    splats, renderer = thing(rng), NativeRenderer()
    angle, about = rng.uniform(0.0, 1.7), rng.uniform(0, 2 * math.pi)
    ray = [math.sin(angle) * math.cos(about), math.sin(angle) * math.sin(about), math.cos(angle)]
    rotation = rotation_from_vector(rng.uniform(-2, 2, 3))
    pose = Pose(rotation, rng.uniform(1.0, 4.0) * np.array(ray))
    whole = renderer.render((PosedSplats(splats, pose),), CAMERA, Pose.identity(), OPTIONS)
    part = extent(splats, CAMERA, pose, margin_px=0)
    cut = renderer.render(
        (PosedSplats(splats, pose),), part_of(CAMERA, part), Pose.identity(), OPTIONS
    )
    np.testing.assert_allclose(cut.alpha, whole.alpha[part], atol=1e-5)
    beside = whole.alpha.copy()
    beside[part] = 0.0
    assert beside.max() == 0.0
    assert whole.alpha.max() > 0.5


def test_the_extent_is_no_larger_than_needed():
    splats = SplatCloud(
        np.zeros((1, 3), np.float32),
        np.full((1, 3), 0.02, np.float32),
        np.array([[1, 0, 0, 0]], np.float32),
        np.ones(1, np.float32),
        np.zeros((1, 1, 3), np.float32),
    )
    rows, columns = extent(splats, CAMERA, Pose.from_yaw(0.0, (0.0, 0.0, 2.0)), margin_px=3)
    reach = 3.4 * 1.6 * 0.02 / 2.0 * CAMERA.f_px + 3
    assert rows == columns
    assert (rows.start, rows.stop) == (math.floor(150 - reach), math.ceil(150 + reach))


def test_what_is_beside_the_picture_keeps_one_pixel():
    rng = np.random.default_rng(1)
    rows, columns = extent(thing(rng), CAMERA, Pose.from_yaw(0.0, (9.0, 0.0, -6.0)), margin_px=2)
    assert columns == slice(299, 300)
    assert rows.stop > rows.start
