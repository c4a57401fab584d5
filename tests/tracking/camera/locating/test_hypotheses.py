"""Hypotheses: the true place is among the first, and no place is there twice."""

import math
from itertools import combinations, pairwise

import numpy as np
import pytest

from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.render.renderer import PosedSplats
from tracking.camera.locating.hypotheses import (
    FOUND_BY_CHANCE,
    HYPOTHESES,
    Refined,
    hypotheses,
    is_apart,
    refined,
)


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


def test_a_pose_a_third_of_a_metre_off_becomes_right_to_centimetres(frame, there, table, objects):
    posed = (PosedSplats(table.scan.room, Pose.identity()), *objects)
    turn = rotation_from_vector(np.radians([3.0, 5.0, -2.0]))
    start = there @ Pose(turn, np.array([0.2, 0.1, -0.2]))
    result = refined(frame, start, posed, table.renderer)
    left = there.inverse() @ result.world_from_rig
    assert np.linalg.norm(left.translation) < 0.05
    assert math.degrees(rotation_angle(left.rotation)) < 1.5
    assert result.nats > 50.0


def test_a_wrong_pose_finds_little_more_than_chance(frame, there, table, objects):
    posed = (PosedSplats(table.scan.room, Pose.identity()), *objects)
    right = refined(frame, there, posed, table.renderer)
    wrong = refined(frame, Pose.from_yaw(2.0) @ there, posed, table.renderer)
    assert wrong.nats < 0.2 * right.nats


def test_nats_grow_with_what_is_found_from_zero_at_chance():
    values = [Refined(Pose.identity(), found, 100).nats for found in range(0, 101, 10)]
    assert values[:2] == [0.0, 0.0]
    assert all(a < b for a, b in pairwise(values[1:]))
    assert values[-1] == pytest.approx(-100 * math.log(FOUND_BY_CHANCE), rel=1e-6)


def test_no_window_says_nothing():
    assert Refined(Pose.identity(), 0, 0).nats == 0.0
