import numpy as np

from scenes.pose import Pose
from studio.handover.keys import POSE_STEPS, Keys, pose_values


def test_of_a_rest_its_first_and_last_moment_are_kept():
    keys = Keys((0.1,))
    for t_ms in range(0, 1000, 100):
        keys.add(t_ms, [0.0])
    keys.add(1000, [1.0])
    keys.add(1100, [1.05])

    assert keys.t_ms == [0, 900, 1000]
    assert keys.values == [(0.0,), (0.0,), (1.0,)]


def test_what_comes_and_goes_is_kept_where_it_does():
    keys = Keys((0.1,))
    for t_ms, value in ((0, None), (100, None), (200, [1.0]), (300, [1.0]), (400, None)):
        keys.add(t_ms, value)

    assert list(zip(keys.t_ms, keys.values, strict=True)) == [
        (0, None),
        (100, None),
        (200, (1.0,)),
        (300, (1.0,)),
        (400, None),
    ]


def test_however_long_a_body_moves_its_keys_stay_few_and_right():
    keys = Keys((0.001,), most=64)
    for step in range(20_000):
        keys.add(step * 33, [step * 0.01])

    assert len(keys.t_ms) <= 64
    assert keys.t_ms == sorted(set(keys.t_ms))
    assert keys.t_ms[0] == 0
    assert keys.t_ms[-1] > 0.9 * 19_999 * 33
    for t_ms, value in zip(keys.t_ms, keys.values, strict=True):
        assert value is not None
        assert np.isclose(value[0], t_ms / 33 * 0.01)
    # Nowhere is a gap that would show: at most a few times the mean one.
    assert np.diff(keys.t_ms).max() < 10 * keys.t_ms[-1] / len(keys.t_ms)


def test_a_turn_past_half_a_circle_is_the_short_way_round():
    before = pose_values(Pose.from_yaw(np.radians(179)), None)
    after = pose_values(Pose.from_yaw(np.radians(181)), before)

    assert np.linalg.norm(np.subtract(after, before)) < 0.05
    assert len(before) == len(POSE_STEPS)
