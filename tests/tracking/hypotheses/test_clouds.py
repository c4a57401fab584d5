"""Clouds of poses climb what is likely, along ridges too, and are the same however many climb."""

import math

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.hypotheses.clouds import Cloud, climb, normal_points

ROUNDS = ((4, 24),) * 6


def on_a_ridge(poses):
    """Log odds that fall ten times as fast across a ridge of place and yaw as along it."""
    found = []
    for pose in poses:
        x, y, z = pose.translation
        yaw = pose.yaw()
        along, across = (x + yaw) / math.sqrt(2.0), (x - yaw) / math.sqrt(2.0)
        found.append(-(along**2) - 100.0 * across**2 - y**2 - z**2)
    return found


def cloud(x, *, yaw, up=0.2):
    spread = np.diag([0.2, 0.2, up, 0.2])
    return Cloud(Pose.from_yaw(yaw, np.array([x, 0.1, 0.0])), spread)


def test_a_climb_goes_along_a_ridge():
    """Along one coordinate after the other it would end near where it begins."""
    start = cloud(0.3, yaw=0.3)
    (found,) = climb([start], on_a_ridge, rounds=ROUNDS)
    assert found.log_odds > 0.1 * on_a_ridge([start.world_from_object])[0]
    assert abs(found.world_from_object.yaw()) < 0.1
    assert found.log_odds == on_a_ridge([found.world_from_object])[0]


def test_a_climb_never_descends_and_the_likeliest_is_first():
    starts = [cloud(x, yaw=0.1) for x in (0.5, 0.1, -0.4)]
    before = sorted(on_a_ridge([start.world_from_object for start in starts]))
    found = climb(starts, on_a_ridge, rounds=ROUNDS[:1])
    odds = [item.log_odds for item in found]
    assert odds == sorted(odds, reverse=True)
    assert all(now >= then for now, then in zip(sorted(odds), before, strict=True))


def test_only_the_likeliest_clouds_go_on():
    starts = [cloud(x, yaw=0.0) for x in (0.9, 0.1, 0.5)]
    found = climb(starts, on_a_ridge, rounds=((2, 16), (1, 16)))
    (alone,) = climb([starts[1]], on_a_ridge, rounds=((1, 16), (1, 16)))
    assert len(found) == 1
    assert np.array_equal(found[0].world_from_object.matrix(), alone.world_from_object.matrix())


def test_a_coordinate_without_spread_stays():
    (found,) = climb([cloud(0.3, yaw=0.0, up=0.0)], on_a_ridge, rounds=ROUNDS)
    assert found.world_from_object.translation[2] == 0.0


@pytest.mark.parametrize("count", [16, 24])
def test_points_are_spread_as_a_normal_distribution_is(count):
    points = normal_points(count)
    assert points.shape == (count, 4)
    assert np.abs(points.mean(axis=0)).max() < 0.25
    assert points.std(axis=0) == pytest.approx(np.ones(4), abs=0.25)
