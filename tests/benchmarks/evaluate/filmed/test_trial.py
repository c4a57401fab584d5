import math

import numpy as np
import pytest

from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.trial import last_of, marker_pose
from scenes.pose import Pose, rotation_angle, rotation_from_vector


def test_what_is_left_of_the_camera_s_error_is_told_in_degrees_and_millimetres(answer):
    turned = Pose(rotation_from_vector(np.radians([0, 0.3, 0])), np.array([0.0, 0.003, 0.004]))
    left = answer({"a": Pose.identity()}, camera=turned).camera_left()
    assert left == pytest.approx((0.3, 5.0))


def test_a_method_without_a_camera_leaves_nothing_to_judge(answer):
    assert all(math.isnan(value) for value in answer({"a": Pose.identity()}).camera_left())


@pytest.mark.parametrize("seed", range(3))
def test_the_marker_is_off_by_what_was_asked_in_a_direction_of_the_seed(seed):
    true = Pose.from_yaw(0.3, (1.0, 2.0, 1.3))
    known = marker_pose(true, Conditions(pose_error_deg=0.5, pose_error_cm=1.0), seed=seed)
    apart = true.inverse() @ known
    assert math.degrees(rotation_angle(apart.rotation)) == pytest.approx(0.5)
    assert np.linalg.norm(known.translation - true.translation) == pytest.approx(0.01)
    other = marker_pose(true, Conditions(), seed=seed + 10)
    assert not np.allclose(other.matrix(), known.matrix())


def test_without_an_error_the_marker_is_right():
    true = Pose.from_yaw(0.3, (1.0, 2.0, 1.3))
    exact = Conditions(pose_error_deg=0.0, pose_error_cm=0.0)
    assert np.allclose(marker_pose(true, exact, seed=1).matrix(), true.matrix())


def test_a_take_without_frames_is_refused():
    with pytest.raises(ValueError, match="without a single frame"):
        last_of(iter(()))
