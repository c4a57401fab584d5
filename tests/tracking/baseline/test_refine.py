import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.baseline.refine import (
    MAX_DRAWINGS,
    NOTHING_DRAWN,
    XY_BOUND_M,
    YAW_BOUND,
    Z_BOUND_M,
    chamfer,
    contour_pixels,
    minimise_chamfer,
    observe_contour,
)


def ellipse(cx, cy, a, b, turn=0.0, size=80):
    y, x = np.mgrid[0:size, 0:size]
    c, s = math.cos(turn), math.sin(turn)
    u, v = c * (x - cx) + s * (y - cy), -s * (x - cx) + c * (y - cy)
    return (u / a) ** 2 + (v / b) ** 2 < 1


def brute_force(p, q):
    squared = ((p[:, None, :] - q[None, :, :]) ** 2).sum(axis=2)
    return squared.min(axis=1).mean() + squared.min(axis=0).mean()


def test_bounds_are_the_papers():
    assert (XY_BOUND_M, Z_BOUND_M) == (0.05, 0.5)
    assert math.degrees(YAW_BOUND) == 22.5


@settings(max_examples=25, deadline=None)
@given(st.integers(25, 55), st.integers(25, 55), st.integers(6, 20), st.integers(6, 20))
def test_chamfer_equals_brute_force(cx, cy, a, b):
    observed = observe_contour(ellipse(40, 40, 15, 10))
    projected = contour_pixels(ellipse(cx, cy, a, b))
    expected = brute_force(projected.astype(float), observed.pixels.astype(float))
    # OpenCV's distances are float32.
    assert abs(chamfer(projected, observed) - expected) < 1e-3 * max(expected, 1.0)


def test_chamfer_is_zero_only_on_itself_and_huge_for_nothing():
    observed = observe_contour(ellipse(40, 40, 15, 10))
    assert chamfer(observed.pixels, observed) == 0.0
    assert chamfer(contour_pixels(ellipse(42, 40, 15, 10)), observed) > 0.5
    assert chamfer(np.zeros((0, 2), np.int64), observed) == NOTHING_DRAWN


def test_holes_have_contours_too():
    ring = ellipse(40, 40, 20, 20) & ~ellipse(40, 40, 10, 10)
    radii = np.hypot(*(contour_pixels(ring) - 40).T)
    assert (radii < 12).any()
    assert (radii > 18).any()


def test_powell_stays_in_its_bounds_and_gets_closer():
    calls = []

    def draw(vector):
        calls.append(vector.copy())
        x, y, z, yaw = vector
        return ellipse(40 + 100 * x / z, 40 + 100 * y / z, 36 / z, 20 / z, yaw)

    start = np.array([0.0, 0.0, 2.0, 0.0])
    truth = np.array([0.03, -0.02, 2.2, 0.25])
    observed = observe_contour(draw(truth))
    before = chamfer(contour_pixels(draw(start)), observed)
    best, loss = minimise_chamfer(start, observed, draw)
    assert loss < 0.3 * before
    bound = np.array([XY_BOUND_M, XY_BOUND_M, Z_BOUND_M, YAW_BOUND])
    assert (
        np.abs(np.array(calls[2:]) - start) <= np.maximum(bound, np.abs(truth - start)) + 1e-9
    ).all()
    assert (np.abs(best - start) <= bound + 1e-9).all()
    assert len(calls) < 1.2 * MAX_DRAWINGS + 20
