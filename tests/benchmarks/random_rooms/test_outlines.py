"""`benchmarks.random_rooms.outlines`: turned boxes that touch or do not."""

import math

import numpy as np
import pytest

from benchmarks.random_rooms.outlines import overlaps, upright
from scenes.pose import Pose


def unit(x, y, *, yaw=0.0, z=0.0):
    return upright((1.0, 1.0, 1.0), Pose.from_yaw(yaw, (x, y, z)))


@pytest.mark.parametrize(
    ("other", "gap", "expected"),
    [
        (unit(0.9, 0.0), 0.0, True),
        (unit(1.1, 0.0), 0.0, False),
        (unit(1.1, 0.0), 0.2, True),
        (unit(1.1, 0.0, yaw=math.pi / 4), 0.0, True),
        (unit(1.1, 1.1, yaw=math.pi / 4), 0.0, False),
        (unit(0.0, 0.0, z=1.0), 0.0, False),
        (unit(0.0, 0.0, z=0.9), 0.0, True),
    ],
)
def test_boxes_overlap_in_plan_and_in_height(other, gap, expected):
    assert overlaps(unit(0.0, 0.0), other, gap) is expected
    assert overlaps(other, unit(0.0, 0.0), gap) is expected


def test_a_turned_box_needs_more_room():
    low, high = np.array([-0.6, -0.6]), np.array([0.6, 0.6])
    assert unit(0.0, 0.0).is_inside(low, high)
    assert not unit(0.0, 0.0, yaw=math.pi / 4).is_inside(low, high)
