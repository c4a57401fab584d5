"""What is shown of a pose glides to it."""

import math

import numpy as np

from scenes.pose import Pose, rotation_angle
from tracking.headset.glide import SPEED_M_PER_S, Glide, glided

ABOUT = np.array([1.0, 0.0, 1.5])


def test_the_first_pose_is_shown_at_once():
    pose = Pose.from_yaw(0.3, (1, 2, 3))
    assert glided(None, pose, t_ns=5, about=ABOUT).b_from_a is pose


def test_a_small_correction_goes_at_a_steady_speed_and_ends_there():
    wanted, shown = Pose.from_yaw(0.0, (0.004, 0.0, 0.0)), Glide(Pose.identity(), 0)
    shown = glided(shown, wanted, t_ns=50_000_000, about=ABOUT)
    assert abs(shown.b_from_a.translation[0] - 0.05 * SPEED_M_PER_S) < 1e-6
    shown = glided(shown, wanted, t_ns=1_000_000_000, about=ABOUT)
    assert np.allclose(shown.b_from_a.translation, wanted.translation)


def test_a_large_one_settles_without_a_jump():
    wanted, shown, steps = Pose.from_yaw(0.2, (0.5, 0.0, 0.0)), Glide(Pose.identity(), 0), []
    for k in range(1, 61):
        after = glided(shown, wanted, t_ns=k * 50_000_000, about=ABOUT)
        steps.append(np.linalg.norm(after.b_from_a @ ABOUT - shown.b_from_a @ ABOUT))
        shown = after
    assert max(steps) < 0.06
    assert rotation_angle(wanted.rotation.T @ shown.b_from_a.rotation) < math.radians(0.2)
