"""Hypotheses: the true place is among the first, and no place is there twice."""

import math
from itertools import combinations

import numpy as np

from scenes.pose import Pose, rotation_angle
from tracking.camera.locating.hypotheses import HYPOTHESES, hypotheses, is_apart


def test_the_first_is_near_the_tilted_camera(frame, there, room_map):
    first = hypotheses(room_map, frame)[0]
    step = there.inverse() @ first
    assert np.linalg.norm(step.translation) < 0.5
    assert math.degrees(rotation_angle(step.rotation)) < 12.0


def test_all_differ(frame, room_map):
    found = hypotheses(room_map, frame)
    assert len(found) == HYPOTHESES
    assert all(is_apart(a, b) for a, b in combinations(found, 2))


def test_two_poses_are_apart_by_place_or_by_turn():
    here = Pose.identity()
    assert not is_apart(here, Pose.from_yaw(math.radians(20), (0.5, 0.0, 0.0)))
    assert is_apart(here, Pose.from_yaw(0.0, (1.0, 0.0, 0.0)))
    assert is_apart(here, Pose.from_yaw(math.radians(170)))
