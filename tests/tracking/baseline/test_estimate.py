import math

import cv2
import numpy as np
import pytest

from tracking.baseline.estimate import coarse_yaw, keypoint_loss
from tracking.baseline.matcher import Matches, SiftMatcher


def points(count, *, outliers=0, seed=0):
    rng = np.random.default_rng(seed)
    first = rng.uniform(0, 200, (count, 2))
    second = first + np.array([5.0, -3.0])
    second[:outliers] += rng.uniform(20, 60, (outliers, 2))
    return Matches(first, second)


def test_loss_counts_matches_and_punishes_outliers():
    assert keypoint_loss(points(30)) == pytest.approx(-30.0)
    assert keypoint_loss(points(30, outliers=10)) == pytest.approx(-20.0, abs=1.0)
    assert keypoint_loss(points(3)) == 0.0


class CountingMatcher:
    """Gives more matches the nearer the grey value of the second picture is to 90."""

    def match(self, first, second):
        return points(int(40 - abs(float(second.mean()) - 90.0) / 10.0))


def test_coarse_yaw_tries_eight_and_takes_the_best():
    tried = []

    def draw(yaw):
        tried.append(math.degrees(yaw))
        return np.full((64, 64, 3), round(math.degrees(yaw) / 2), np.uint8)

    yaw, losses = coarse_yaw(np.zeros((64, 64, 3), np.uint8), draw, CountingMatcher(), fallback=9.0)
    assert tried == pytest.approx([0, 45, 90, 135, 180, 225, 270, 315])
    assert math.degrees(yaw) == pytest.approx(180.0)
    assert min(losses) == losses[4]


def test_without_any_match_the_last_yaw_is_kept():
    blank = np.zeros((64, 64, 3), np.uint8)
    yaw, _ = coarse_yaw(blank, lambda _: blank, SiftMatcher(), fallback=1.25)
    assert yaw == 1.25


def test_sift_finds_a_turned_pattern_again():
    rng = np.random.default_rng(4)
    pattern = cv2.resize(rng.integers(0, 255, (16, 16, 3), np.uint8), (200, 200))
    matrix = cv2.getRotationMatrix2D((100, 100), 20, 1.0)
    turned = cv2.warpAffine(pattern, matrix, (200, 200))
    found = SiftMatcher().match(pattern, turned)
    expected = found.first @ matrix[:, :2].T + matrix[:, 2]
    good = np.linalg.norm(expected - found.second, axis=1) < 2.0
    assert good.sum() > 20
    assert good.mean() > 0.7
