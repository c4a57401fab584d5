"""Steps and twists move points the same way."""

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.render.pose_step import moved, twists_of_camera, twists_of_object

CAMERA = Pose.from_quaternion(np.array([0.8, 0.0, 0.6, 0.0]), (0.4, -1.0, 0.3))
OBJECT = Pose.from_quaternion(np.array([0.5, 0.5, -0.5, 0.5]), (1.0, 2.0, -0.5))
POINTS = np.random.default_rng(0).normal(size=(20, 3))


def seen(world_from_camera, world_from_object):
    return (world_from_camera.inverse() @ world_from_object) @ POINTS


@pytest.mark.parametrize("entry", range(6))
@pytest.mark.parametrize("what", ["object", "camera"])
def test_a_twist_is_what_the_camera_sees_of_a_step(what, entry):
    size = 1e-6
    step = size * np.eye(6)[entry]
    if what == "object":
        twist = twists_of_object(CAMERA, OBJECT)[entry]
        after, before = seen(CAMERA, moved(OBJECT, step)), seen(CAMERA, moved(OBJECT, -step))
    else:
        twist = twists_of_camera(CAMERA)[entry]
        after, before = seen(moved(CAMERA, step), OBJECT), seen(moved(CAMERA, -step), OBJECT)
    wanted = twist[:3] + np.cross(twist[3:], seen(CAMERA, OBJECT))
    np.testing.assert_allclose((after - before) / (2 * size), wanted, atol=1e-8)


def test_a_step_turns_about_the_frames_own_origin():
    step = np.array([0.1, 0.2, 0.3, 0.0, 0.0, np.pi / 2])
    after = moved(Pose.from_yaw(0.3, (1.0, 2.0, 3.0)), step)
    np.testing.assert_allclose(after.translation, [1.1, 2.2, 3.3])
    assert after.yaw() == pytest.approx(0.3 + np.pi / 2)
