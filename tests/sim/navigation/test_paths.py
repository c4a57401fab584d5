from __future__ import annotations

import itertools

import numpy as np

from sim.navigation.floor import BODY_RADIUS_M
from sim.navigation.paths import free_floor, walking_path


def _distance_to_segment(point, a, b):
    t = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(a + t * (b - a) - point)


def test_a_clear_way_is_straight(small_room):
    floor = free_floor(small_room, [])
    goal = np.array([1.0, -1.0])
    assert walking_path(floor, np.array([-1.0, -1.0]), goal) == [goal]


def test_a_way_goes_around_an_obstacle_and_the_table(small_room):
    post = np.array([0.0, 0.0])
    floor = free_floor(small_room, [(post, 0.3)])
    start, goal = np.array([-1.0, 0.0]), np.array([1.0, 0.0])
    points = [start, *walking_path(floor, start, goal)]
    assert len(points) > 2
    assert np.array_equal(points[-1], goal)
    for a, b in itertools.pairwise(points):
        assert _distance_to_segment(post, a, b) > 0.4
    table = np.array([1.4, 0.7])
    assert not floor.is_clear(np.array([0.5, 0.7]), table)
    beside = floor.nearest_free(table)
    outside = np.maximum(np.abs(beside - table) - [0.3, 0.5], 0)
    assert np.linalg.norm(outside) > BODY_RADIUS_M


def test_where_there_is_no_way_the_straight_one_is_taken(small_room):
    fence = [(np.array([0.0, y]), 0.3) for y in np.arange(-2.0, 2.1, 0.3)]
    floor = free_floor(small_room, fence)
    goal = np.array([1.5, -1.5])
    assert walking_path(floor, np.array([-1.5, -1.5]), goal) == [goal]
