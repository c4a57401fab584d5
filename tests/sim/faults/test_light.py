"""Faults of lens and exposure, on pictures whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from sim.faults.light import Blur, Exposure, WhiteBalance, gain_curve, stroke_kernel, with_gains

POINT = np.zeros((61, 61, 3), np.uint8)
POINT[30, 30] = 255
POINT.setflags(write=False)


def linear(levels):
    s = np.asarray(levels, dtype=float) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("ev", [-1.0, 1.0])
def test_one_step_of_exposure_is_twice_the_light(ev):
    grey = np.full((2, 2, 3), 100, np.uint8)
    (seen,) = Exposure(ev).seen([grey], 0.0)
    assert linear(seen[0, 0]) == pytest.approx(linear(100) * 2.0**ev, rel=0.02)


def test_gains_keep_black_and_clip_at_white():
    curve = gain_curve([2.0, 1.0, 0.5])
    assert curve.shape == (256, 1, 3)
    assert curve[0].tolist() == [[0, 0, 0]]
    assert curve[255, 0, 0] == 255
    assert (curve[:, 0, 1] == np.arange(256)).all()
    (same,) = with_gains([POINT], [1.0, 1.0, 1.0])
    assert (same == POINT).all()


def test_a_warm_balance_is_redder_and_less_blue():
    grey = np.full((2, 2, 3), 100, np.uint8)
    (seen,) = WhiteBalance(0.25).seen([grey], 0.0)
    red, green, blue = seen[0, 0]
    assert green == 100
    assert linear(red) == pytest.approx(1.25 * linear(100), rel=0.02)
    assert linear(blue) == pytest.approx(linear(100) / 1.25, rel=0.02)


def spread(weights, axis):
    at = np.arange(weights.shape[axis])
    shares = weights.sum(axis=1 - axis) / weights.sum()
    mean = shares @ at
    return float(np.sqrt(shares @ (at - mean) ** 2))


def test_defocus_spreads_a_point_alike_in_both_directions():
    (seen,) = Blur(2.0).seen([np.where(POINT, 255, 0).astype(np.uint8)], 0.0)
    weights = seen[..., 1].astype(float)
    assert spread(weights, 0) == pytest.approx(2.0, rel=0.15)
    assert spread(weights, 1) == pytest.approx(2.0, rel=0.15)


def test_motion_spreads_along_its_direction_only():
    kernel = stroke_kernel(3.0, 0.0)
    assert kernel.sum() == pytest.approx(1.0, abs=1e-5)
    assert spread(kernel, 1) == pytest.approx(3.0, rel=0.05)
    assert spread(kernel, 0) < 1e-6
    upright = stroke_kernel(3.0, np.pi / 2)
    assert spread(upright, 0) == pytest.approx(3.0, rel=0.05)
    (seen,) = Blur(3.0, "motion").seen([POINT], 0.0)
    assert spread(seen[..., 0].astype(float), 0) < 1e-6
