import numpy as np
import pytest

from scenes.pose import Pose
from tracking.baseline.associate import ray_hits_box

BOX = (0.4, 0.6, 1.0)


def hit(origin, direction, pose=None):
    way = np.asarray(direction, dtype=np.float64)
    return ray_hits_box(
        np.asarray(origin, dtype=np.float64),
        way / np.linalg.norm(way),
        world_from_object=pose or Pose.identity(),
        box_m=BOX,
    )


def test_a_ray_hits_the_box_that_stands_on_the_origin():
    assert hit((2.0, 0.0, 0.5), (-1, 0, 0)) == pytest.approx(1.8)
    assert hit((0.0, 0.0, 3.0), (0, 0, -1)) == pytest.approx(2.0)


def test_a_ray_misses_above_beside_and_behind():
    assert hit((2.0, 0.0, 1.1), (-1, 0, 0)) is None
    assert hit((2.0, 0.31, 0.5), (-1, 0, 0)) is None
    assert hit((2.0, 0.0, 0.5), (1, 0, 0)) is None


def test_the_box_turns_with_the_object():
    turned = Pose.from_yaw(np.pi / 2, (1.0, 0.0, 0.0))
    assert hit((3.0, 0.0, 0.5), (-1, 0, 0), turned) == pytest.approx(1.7)


def test_from_inside_the_distance_is_zero():
    assert hit((0.0, 0.0, 0.5), (0.3, 0.2, 0.9)) == 0.0
