"""Points of other views drawn as depth: the nearest surface, without its noise, and no strays."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.train.depth.propagated import propagated_depth

CAMERA = Pinhole.from_fov(60, 45, 1.2)
HERE = Pose.from_quaternion((1, 0, 0, 0), (0.3, 0.0, 0.0))


def plane(z, low, high, seed=0, count=200_000):
    rng = np.random.default_rng(seed)
    at = rng.uniform([low, -3], [high, 3], (count, 2))
    return np.column_stack([at, z + rng.normal(0, 0.002, count)]).astype(np.float32)


def test_the_nearest_surface_is_lent_at_its_mean_depth():
    points = np.concatenate([plane(4.0, -5, 5), plane(2.0, -5, 0.3)])
    depth = propagated_depth(CAMERA, HERE, points)
    np.testing.assert_allclose(depth[:, :28], 2.0, atol=0.006)
    np.testing.assert_allclose(depth[:, 32:], 4.0, atol=0.006)


def test_where_no_point_is_nothing_is_lent():
    depth = propagated_depth(CAMERA, HERE, plane(2.0, -5, 0.3))
    assert not depth[:, 34:].any()
    assert not propagated_depth(CAMERA, HERE, np.zeros((0, 3), np.float32)).any()


def test_a_stray_point_hides_nothing_for_good():
    stray = np.array([[0.3, 0.0, 1.0]], dtype=np.float32)
    depth = propagated_depth(CAMERA, HERE, np.concatenate([plane(2.0, -5, 5), stray]))
    known = depth > 0
    assert known.mean() > 0.98
    assert depth[known].min() == pytest.approx(2.0, abs=0.02)


def test_points_behind_the_camera_are_not_seen():
    assert not propagated_depth(CAMERA, HERE, plane(-2.0, -5, 5)).any()
