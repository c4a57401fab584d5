"""One step of the filter: corners to a pose with covariance."""

import math

import numpy as np

from scenes.cameras import Pinhole
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from tracking.headset.corner_fit import (
    Belief,
    SeenPoints,
    code_corners,
    distance,
    poses_of_square,
    spread_px2,
    updated,
)

CAMERA = Pinhole.from_fov(760, 428, math.radians(65))
TRUE = Pose(rotation_from_vector(np.array([math.pi - 0.3, 0.2, 0.1])), np.array([0.1, -0.1, 2.0]))


def seen(sigma_px=0.05):
    points = code_corners(0.24)
    pixels, _ = CAMERA.project(TRUE @ points)
    return SeenPoints(CAMERA, Pose.identity(), points, pixels, np.full(4, sigma_px))


def wide(pose):
    return Belief(pose, np.diag(np.repeat((0.3, 1.0), 3) ** 2), np.zeros(3), 0)


def test_a_square_has_its_pose_among_two():
    found = poses_of_square(CAMERA, seen().pixels, side_m=0.24)
    assert min(rotation_angle(pose.rotation.T @ TRUE.rotation) for pose in found) < 1e-3


def test_a_belief_comes_to_the_pose_that_corners_show():
    start = TRUE @ Pose(
        rotation_from_vector(np.array([0.05, -0.04, 0.08])), np.array([0.03, 0, 0.05])
    )
    belief = updated(wide(start), seen())
    assert np.linalg.norm(belief.a_from_b.translation - TRUE.translation) < 1e-3
    assert belief.sigma_shift_m < 0.1
    assert (np.linalg.eigvalsh(belief.covariance) > 0).all()


def test_what_fits_is_near_and_what_does_not_is_far():
    belief = updated(wide(TRUE), seen())
    assert distance(belief, seen()) < 1.0
    elsewhere = Belief(
        TRUE @ Pose(np.eye(3), np.array([0.2, 0, 0])), belief.covariance, np.zeros(3), 0
    )
    assert distance(elsewhere, seen()) > 40.0


def test_points_behind_the_camera_are_refused():
    behind = wide(Pose(TRUE.rotation, np.array([0.0, 0.0, -2.0])))
    assert math.isinf(distance(behind, seen()))
    assert updated(behind, seen()) is None
    assert spread_px2(behind, seen()) is None


def test_time_makes_a_belief_less_certain():
    belief = updated(wide(TRUE), seen())
    later = belief.later(4_000_000_000, turn_rad=0.01, shift_m=0.02)
    more = later.covariance - belief.covariance
    assert np.allclose(np.diag(more), np.repeat((4e-4, 1.6e-3), 3))
