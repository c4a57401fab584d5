"""The first splats."""

from dataclasses import replace

import numpy as np

from scenes.pose import rotation_from_quaternion
from scenes.prepare.train.seed import FIRST_OPACITY, seed_rows


def test_points_become_splats_of_their_colour_and_spacing(filmed_ball):
    rows = seed_rows(filmed_ball, [], 4, 10_000, np.random.default_rng(0))
    cloud = rows.to_cloud()
    np.testing.assert_allclose(cloud.means, filmed_ball.points, atol=1e-6)
    np.testing.assert_allclose(cloud.colours(), filmed_ball.colours / 255, atol=1e-5)
    np.testing.assert_allclose(cloud.opacities, FIRST_OPACITY, rtol=1e-5)
    # 400 points on a ball of 1 m: some 0.18 m apart.
    assert 0.05 < np.median(cloud.scales) < 0.2
    # Thin across the ball, and as wide as each other along it.
    thin = rotation_from_quaternion(cloud.rotations)[:, :, 0]
    assert np.abs((thin * filmed_ball.points).sum(axis=1)).mean() > 0.9
    assert np.median(cloud.scales[:, 0] / cloud.scales[:, 1]) < 0.5
    np.testing.assert_array_equal(cloud.scales[:, 1], cloud.scales[:, 2])
    assert (cloud.sh[:, 1:] == 0).all()


def test_no_more_than_the_budget(filmed_ball):
    rows = seed_rows(filmed_ball, [], 1, 50, np.random.default_rng(0))
    assert len(rows) == 50
    assert len(np.unique(rows.values[:, :3], axis=0)) == 50


def test_points_on_top_of_each_other_get_a_width(filmed_ball):
    points = np.repeat(filmed_ball.points[:40], 10, axis=0)
    stacked = replace(filmed_ball, points=points)
    scales = seed_rows(stacked, [], 1, 10_000, np.random.default_rng(0)).to_cloud().scales
    assert (scales > 0).all()
    assert np.isfinite(scales).all()
