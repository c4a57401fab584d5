"""How far a measured pose may be off, by what it may be off for."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose, rotation_from_vector
from tracking.solve.covariance import EDGE_SIGMA_M, uncertainty

FREE = np.eye(6)[[0, 1, 2, 5]]
"""A pose that follows whatever is seen."""


def known(place, camera_sigma, *, response=FREE, world_from_rig=None, radius_m=0.5):
    """The standard deviations of an object at a place, without noise of its own."""
    rig = world_from_rig or Pose.identity()
    scene = SimpleNamespace(world_from_rig=rig, camera_sigma=np.array(camera_sigma))
    fit = SimpleNamespace(
        world_from_object=Pose.from_yaw(0.0, place),
        covariance=np.zeros((4, 4)),
        response=np.asarray(response),
    )
    covariance = uncertainty(scene, SimpleNamespace(radius_m=radius_m), fit)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-15)
    return np.sqrt(np.diag(covariance))


def test_a_camera_turned_about_up_moves_what_is_far_sideways_and_turns_it():
    x, y, z, yaw = known((4.0, 0.0, 0.0), (0, 0, 1e-3, 0, 0, 0))
    assert y == pytest.approx(np.hypot(4e-3, EDGE_SIGMA_M))
    assert x == pytest.approx(np.hypot(EDGE_SIGMA_M / 0.5 * 4.0, EDGE_SIGMA_M))
    assert z == pytest.approx(EDGE_SIGMA_M)
    assert yaw == pytest.approx(np.hypot(1e-3, EDGE_SIGMA_M / 0.5))


def test_an_error_of_the_camera_equals_the_move_of_what_is_seen():
    # The covariance of a tiny turn about one axis is the outer product of the true displacement.
    axis, place = np.array([1e-3, 0.0, 0.0]), np.array([0.5, 1.5, -1.2])
    moved = rotation_from_vector(axis) @ place - place
    sigma = known(place, (1e-3, 0, 0, 0, 0, 0))
    along = EDGE_SIGMA_M / 0.5 * np.abs(place)
    wanted = np.sqrt(moved**2 + along**2 + EDGE_SIGMA_M**2)
    np.testing.assert_allclose(sigma[:3], wanted, rtol=1e-3)


def test_the_camera_s_doubts_are_told_in_its_own_axes():
    turned = Pose.from_yaw(np.pi / 2)
    x, y, _, _ = known((0.0, 0.0, 0.0), (0, 0, 0, 0.01, 0, 0), world_from_rig=turned)
    assert x == pytest.approx(EDGE_SIGMA_M)
    assert y == pytest.approx(np.hypot(0.01, EDGE_SIGMA_M))


def test_what_stands_does_not_follow_the_camera_upwards():
    standing = FREE.copy()
    standing[2] = 0.0
    assert known((2.0, 0.0, -1.0), (1e-3,) * 6, response=standing)[2] == pytest.approx(0.0)


def test_how_far_away_and_turned_a_small_thing_is_is_known_less_well():
    still, place = (0.0,) * 6, (300.0, 0.0, 0.0)
    small, large = known(place, still, radius_m=0.1), known(place, still, radius_m=0.5)
    assert small[0] == pytest.approx(5 * large[0], rel=1e-3)
    assert small[3] == pytest.approx(5 * large[3])
    assert small[1] == pytest.approx(large[1])
