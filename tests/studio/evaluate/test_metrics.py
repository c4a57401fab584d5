import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.pose import Pose
from studio.evaluate.metrics import error_table, pose_error, spread
from tracking.model.symmetry import ROUND

angles = st.floats(-6.0, 6.0)


def test_error_in_centimetres_and_degrees():
    true = Pose.from_yaw(0.2, (1.0, 2.0, 0.0))
    estimated = Pose.from_yaw(0.2 + math.radians(3.0), (1.03, 1.96, 0.0))
    error = pose_error(estimated, true)
    assert error.x_cm == pytest.approx(3.0)
    assert error.y_cm == pytest.approx(4.0)
    assert error.world_cm == pytest.approx(5.0)
    assert error.yaw_deg == pytest.approx(3.0)


@given(angles, angles, st.sampled_from([1, 2, 4]))
def test_yaw_error_is_symmetric_and_bounded_by_half_a_repeat(a, b, symmetry):
    first, second = Pose.from_yaw(a), Pose.from_yaw(b)
    forth = pose_error(first, second, symmetry=symmetry).yaw_deg
    back = pose_error(second, first, symmetry=symmetry).yaw_deg
    assert forth == pytest.approx(back, abs=1e-6)
    assert 0.0 <= forth <= 180.0 / symmetry + 1e-6


def test_a_repeat_of_the_shape_is_no_error_and_round_objects_have_none():
    quarter = Pose.from_yaw(math.pi / 2)
    assert pose_error(quarter, Pose.identity(), symmetry=4).yaw_deg == pytest.approx(0.0, abs=1e-6)
    assert pose_error(quarter, Pose.identity(), symmetry=1).yaw_deg == pytest.approx(90.0)
    assert pose_error(quarter, Pose.identity(), symmetry=ROUND).yaw_deg == 0.0


def test_the_point_that_counts_can_be_chosen():
    turned = Pose.from_yaw(math.pi)
    assert pose_error(turned, Pose.identity()).world_cm == pytest.approx(0.0, abs=1e-9)
    assert pose_error(turned, Pose.identity(), centre_m=(0.1, 0, 0)).world_cm == pytest.approx(20.0)


def test_spread_and_table():
    values = spread([1.0, 2.0, 3.0, 4.0])
    assert (values.mean, values.max, values.count) == (2.5, 4.0, 4)
    assert values.std == pytest.approx(math.sqrt(1.25))
    table = error_table(
        [pose_error(Pose.from_yaw(0.0, (x, 0, 0)), Pose.identity()) for x in (0.01, 0.03)]
    )
    assert table["world_cm"].mean == pytest.approx(2.0)
    assert table["yaw_deg"].max == 0.0


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="no values"):
        spread([])
    with pytest.raises(ValueError, match="symmetry -1"):
        pose_error(Pose.identity(), Pose.identity(), symmetry=-1)
