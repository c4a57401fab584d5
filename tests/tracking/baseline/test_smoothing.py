import math

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.baseline.smoothing import MEASUREMENT_STD, PROCESS_STD, Glide, Kalman
from tracking.solve.motion import Motion


def test_constants_are_the_papers():
    assert (PROCESS_STD, MEASUREMENT_STD) == (0.3, 0.1)


def test_kalman_gain_follows_from_the_two_noises():
    start = Kalman.at(Pose.identity())
    moved = start.update(Pose.from_yaw(0.0, (1.0, 0.0, 0.0)))
    predicted = MEASUREMENT_STD**2 + PROCESS_STD**2
    gain = predicted / (predicted + MEASUREMENT_STD**2)
    assert moved.value[0] == pytest.approx(gain)
    assert moved.variance[0] == pytest.approx((1 - gain) * predicted)


def test_kalman_settles_on_a_constant_measurement_and_a_steady_variance():
    track, target = Kalman.at(Pose.identity()), Pose.from_yaw(1.0, (0.3, -0.2, 0.1))
    for _ in range(20):
        track = track.update(target)
    np.testing.assert_allclose(track.pose().translation, target.translation, atol=1e-9)
    p = track.variance[0]
    steady = (p + PROCESS_STD**2) * MEASUREMENT_STD**2 / (p + PROCESS_STD**2 + MEASUREMENT_STD**2)
    assert p == pytest.approx(steady, rel=1e-6)


def test_kalman_takes_the_short_way_round():
    track = Kalman.at(Pose.from_yaw(math.radians(179)))
    turned = track.update(Pose.from_yaw(math.radians(-179)))
    assert math.degrees(turned.value[3]) == pytest.approx(180.8, abs=0.3)


def test_glide_is_linear_and_held_outside():
    a, b = Pose.from_yaw(0.0, (0, 0, 0)), Pose.from_yaw(math.pi / 2, (2.0, 0, 0))
    glide = Glide(a, b, 1000, 2000)
    assert glide.at(0).translation[0] == 0.0
    assert glide.at(1250).translation[0] == pytest.approx(0.5)
    assert glide.at(1250).yaw() == pytest.approx(math.pi / 8)
    assert glide.at(3000).translation[0] == 2.0
    assert Glide(a, b, 5, 5).at(5).translation[0] == 2.0


def test_motion_predicts_less_than_it_measured():
    before, after = Pose.identity(), Pose.from_yaw(0.1, (0.1, 0, 0))
    motion = Motion.rest(0)
    for k in range(1, 30):
        motion = motion.measured(before, after, k * 100_000_000)
    assert motion.velocity[0] == pytest.approx(1.0, rel=1e-3)
    ahead = motion.predict(after, motion.t_ns + 100_000_000)
    assert 0.1 < ahead.translation[0] < 0.2
    assert motion.predict(after, motion.t_ns).translation[0] == pytest.approx(0.1)
