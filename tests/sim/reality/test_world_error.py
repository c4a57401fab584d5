"""`sim.reality.world_error`: the real room is a little elsewhere than the scan says."""

import numpy as np
import pytest

from scenes.pose import Pose
from sim.reality.world_error import drawn_error


def test_without_uncertainty_there_is_no_error():
    error = drawn_error(np.zeros((7, 7)), np.random.default_rng(0))
    pose = Pose.from_yaw(0.3, (1.0, 2.0, 0.5))
    assert np.allclose(error.moved(pose).matrix(), pose.matrix())


def test_drawn_errors_have_the_covariance_they_were_drawn_from():
    root = np.random.default_rng(1).standard_normal((7, 7)) * 1e-3
    covariance = root @ root.T
    rng = np.random.default_rng(2)
    far = np.array([3.0, 0.0, 0.0])
    drawn = [drawn_error(covariance, rng) for _ in range(4000)]
    shifts = np.array([error.shift_m for error in drawn])
    scales = np.log([error.scale for error in drawn])
    assert np.allclose(np.cov(shifts.T), covariance[3:6, 3:6], atol=0.1 * covariance.max())
    assert np.std(scales) == pytest.approx(np.sqrt(covariance[6, 6]), rel=0.1)
    moved = drawn[0].moved(Pose(np.eye(3), far)).translation
    assert np.allclose(moved, drawn[0].scale * drawn[0].rotation @ far + drawn[0].shift_m)
