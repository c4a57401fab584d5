from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.poses.sfm.outcome import epipolar_distances_px

A = Pinhole(640, 480, 500.0, 510.0, 320.0, 240.0)
B = Pinhole(800, 600, 700.0, 690.0, 390.0, 310.0)


def seen(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform([-2, -2, 3], [2, 2, 8], (60, 3))
    b_from_a = Pose(rotation_from_vector(rng.normal(0, 0.1, 3)), rng.uniform(0.2, 0.5, 3))
    return A.project(points)[0], B.project(b_from_a @ points)[0], b_from_a


@given(st.integers(0, 1000))
def test_true_matches_lie_on_their_lines(seed):
    first, second, b_from_a = seen(seed)
    assert epipolar_distances_px(first, second, (A, B), b_from_a).max() < 1e-6


@given(st.integers(0, 1000))
def test_a_small_shift_is_at_most_its_own_length_away(seed):
    first, second, b_from_a = seen(seed)
    off = epipolar_distances_px(first, second + np.array([3.0, 4.0]), (A, B), b_from_a)
    assert off.max() <= 5.1
    assert off.max() > 0.5


def test_wrong_poses_are_far_off_and_no_baseline_is_infinite():
    first, second, b_from_a = seen(3)
    wrong_from_a = Pose(rotation_from_vector([0.3, 0.2, 0.1]), b_from_a.translation)
    assert np.median(epipolar_distances_px(first, second, (A, B), wrong_from_a)) > 10
    assert np.isinf(epipolar_distances_px(first, second, (A, B), Pose.identity())).all()
