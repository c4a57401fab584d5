"""Nothing of an object is seen beside its extent."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.pose import Pose, rotation_from_quaternion, rotation_from_vector
from scenes.splats import SplatCloud
from tracking.window.extent import extent, part_of

CAMERA = Fisheye.from_fov(300, math.radians(200))


def physical(rng):
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
def test_all_of_every_splat_that_can_be_seen_is_within_the_extent(seed):
    rng = np.random.default_rng(seed)
    splats = physical(rng)
    angle, about = rng.uniform(0.0, 1.7), rng.uniform(0, 2 * math.pi)
    ray = [math.sin(angle) * math.cos(about), math.sin(angle) * math.sin(about), math.cos(angle)]
    rotation = rotation_from_vector(rng.uniform(-2, 2, 3))
    pose = Pose(rotation, rng.uniform(1.0, 4.0) * np.array(ray))
    rows, columns = extent(splats, CAMERA, pose, margin_px=0)
    # Points on each splat's surface where the strongest fades to 1/255.
    on_sphere = rng.normal(size=(200, 3))
    on_sphere *= math.sqrt(2 * math.log(255)) / np.linalg.norm(on_sphere, axis=1, keepdims=True)
    for mean, scale, wxyz in zip(splats.means, splats.scales, splats.rotations, strict=True):
        local = rotation_from_quaternion(wxyz.astype(np.float64))
        pixels, seen = CAMERA.project(pose @ (mean + (on_sphere * scale) @ local.T))
        x, y = pixels[seen].T
        assert ((columns.start <= x) & (x <= columns.stop)).all()
        assert ((rows.start <= y) & (y <= rows.stop)).all()


def test_a_part_of_a_picture_shows_the_same_in_its_own_pixels():
    part = slice(40, 90), slice(100, 180)
    points = np.array([[0.1, -0.4, 1.0], [0.5, 0.2, 2.0]])
    whole, _ = CAMERA.project(points)
    np.testing.assert_allclose(part_of(CAMERA, part).project(points)[0], whole - [100, 40])


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
    rows, columns = extent(physical(rng), CAMERA, Pose.from_yaw(0.0, (9.0, 0.0, -6.0)), margin_px=2)
    assert columns == slice(299, 300)
    assert rows.stop > rows.start
