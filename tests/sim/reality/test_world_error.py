"""`sim.reality.world_error`: the real room is a little elsewhere than the scan says."""

from pathlib import Path

import numpy as np
import pytest

from scenes.package.reality import Reality
from scenes.pose import Pose
from sim.reality.world_error import WorldError, drawn_error

CENTRE = np.array([1.0, -1.0, 1.5])


def reality(covariance, bend=0.0):
    return Reality(Path("none.ply"), "test", 1, 1, covariance, bend, CENTRE)


def test_without_uncertainty_there_is_no_error():
    error = drawn_error(reality(np.zeros((7, 7))), np.random.default_rng(0))
    pose = Pose.from_yaw(0.3, (1.0, 2.0, 0.5))
    assert np.allclose(error.moved(pose).matrix(), pose.matrix())


def test_drawn_errors_have_the_covariance_they_were_drawn_from():
    root = np.random.default_rng(1).standard_normal((7, 7)) * 1e-3
    covariance = root @ root.T
    rng = np.random.default_rng(2)
    drawn = [drawn_error(reality(covariance), rng) for _ in range(4000)]
    shifts = np.array([error.shift_m for error in drawn])
    scales = np.log([np.cbrt(np.linalg.det(error.linear)) for error in drawn])
    assert np.allclose(np.cov(shifts.T), covariance[3:6, 3:6], atol=0.1 * covariance.max())
    assert np.std(scales) == pytest.approx(np.sqrt(covariance[6, 6]), rel=0.1)


def test_a_bend_moves_points_by_as_much_a_metre_as_is_predicted():
    rng = np.random.default_rng(3)
    away = np.array([2.0, 0.0, 0.0])
    moved = []
    for _ in range(3000):
        error = drawn_error(reality(np.zeros((7, 7)), bend=1e-3), rng)
        still, far = (error.moved(Pose(np.eye(3), p)).translation for p in (CENTRE, CENTRE + away))
        assert np.allclose(still, CENTRE)
        moved.append(np.linalg.norm(far - CENTRE - away))
    assert np.sqrt(np.mean(np.square(moved))) == pytest.approx(2e-3, rel=0.05)


def test_an_error_can_be_undone():
    rng = np.random.default_rng(4)
    error = WorldError(np.eye(3) + 1e-3 * rng.standard_normal((3, 3)), np.array([0.01, 0.0, -0.02]))
    pose = Pose.from_yaw(0.7, (3.0, -1.0, 0.4))
    again = error.inverse().moved(error.moved(pose))
    assert np.allclose(again.matrix(), pose.matrix(), atol=1e-9)


def test_a_rigid_error_is_not_noticed_by_who_lays_the_worlds_onto_each_other():
    points = np.random.default_rng(5).standard_normal((20, 3))
    rigid = Pose.from_yaw(0.02, (0.1, -0.05, 0.01))
    left = WorldError(rigid.rotation, rigid.translation).without_motion(points)
    assert np.allclose(left.linear, np.eye(3), atol=1e-9)
    assert np.allclose(left.shift_m, 0.0, atol=1e-9)
    scaled = WorldError(1.01 * rigid.rotation, rigid.translation).without_motion(points)
    assert np.allclose(scaled.linear, 1.01 * np.eye(3), atol=1e-9)
    assert np.allclose(scaled.linear @ points.mean(axis=0) + scaled.shift_m, points.mean(axis=0))
