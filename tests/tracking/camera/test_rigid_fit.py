"""The rig's motion from displacements: exact, robust, and no surer than a scan's regions allow."""

import numpy as np
import pytest

from tracking.camera.displacements import Displacements
from tracking.camera.rigid_fit import REGION_RAD, REGION_SIGMA_RAD, rigid_fit

F_PX = 200.0
TWIST = np.array([0.004, -0.003, 0.002, 0.006, -0.004, 0.005])
WEAK = np.eye(6) * 1e2


def seen(rng, *, count=1500, twist=TWIST, noise_rad=1e-4):
    """Windows all over a lens, on surfaces 1 m to 4 m away, that saw a motion of the rig."""
    rays = rng.uniform(-1.0, 1.0, (count, 2))
    range_m = rng.uniform(1.0, 4.0, count)
    x, y, near = rays[:, 0], rays[:, 1], 1.0 / range_m
    zero = np.zeros(count)
    # A pinhole's: small turns about x and y shift, one about z turns, shifts fall off with range.
    along_x = np.stack([x * y, -(1 + x * x), y, -near, zero, x * near], axis=1)
    along_y = np.stack([1 + y * y, -x * y, -x, zero, -near, y * near], axis=1)
    by_twist = np.stack([along_x, along_y], axis=1)
    shift = by_twist @ twist + rng.normal(0, noise_rad, (count, 2))
    information = np.broadcast_to(np.eye(2) / noise_rad**2, (count, 2, 2)).copy()
    pixels = (rays + 1.0) * F_PX
    return Displacements(pixels, F_PX, shift, by_twist, information, range_m, 1.0)


def moved(windows, chosen, by_rad):
    shift = windows.shift.copy()
    shift[chosen] += by_rad
    return Displacements(
        windows.pixels,
        windows.f_px,
        shift,
        windows.by_twist,
        windows.information,
        windows.range_m,
        windows.share,
    )


def test_a_motion_is_recovered_from_what_it_did():
    fit = rigid_fit([seen(np.random.default_rng(1))], np.zeros(6), WEAK)
    np.testing.assert_allclose(fit.twist, TWIST, atol=1e-4)


def test_a_third_of_wild_windows_changes_little():
    rng = np.random.default_rng(2)
    windows = seen(rng)
    wild = rng.random(1500) < 0.33
    fit = rigid_fit(
        [moved(windows, wild, rng.uniform(-0.05, 0.05, (wild.sum(), 2)))], np.zeros(6), WEAK
    )
    np.testing.assert_allclose(fit.twist, TWIST, atol=4e-4)


def test_a_wall_that_is_displaced_as_a_whole_does_not_decide():
    windows = seen(np.random.default_rng(3))
    wall = (windows.pixels < 1.3 * F_PX).all(axis=1) & (windows.pixels > 0.3 * F_PX).all(axis=1)
    by = np.array([0.004, 0.002])
    fit = rigid_fit([moved(windows, wall, by)], np.zeros(6), WEAK)
    plain = np.linalg.lstsq(
        windows.by_twist.reshape(-1, 6), moved(windows, wall, by).shift.ravel(), rcond=None
    )[0]
    assert np.abs(fit.twist - TWIST)[:3].max() < 0.5 * np.abs(plain - TWIST)[:3].max()


def test_more_windows_in_the_same_regions_do_not_make_it_surer():
    rng = np.random.default_rng(4)
    few, many = (rigid_fit([seen(rng, count=n)], np.zeros(6), WEAK) for n in (1500, 6000))
    sigma = [np.sqrt(np.diag(np.linalg.inv(fit.information)))[0] for fit in (few, many)]
    assert sigma[1] > 0.7 * sigma[0]


def test_its_deviation_is_that_of_regions_which_are_off():
    rng = np.random.default_rng(5)
    off = []
    for _ in range(20):
        windows = seen(rng)
        region = np.floor(windows.pixels / (F_PX * REGION_RAD)).astype(int)
        by = rng.normal(0, 5 * REGION_SIGMA_RAD, (20, 20, 2))
        shifted = moved(windows, slice(None), by[region[:, 0], region[:, 1]])
        fit = rigid_fit([shifted], np.zeros(6), WEAK)
        sigma = np.sqrt(np.diag(np.linalg.inv(fit.information)))
        off.append((fit.twist - TWIST) / sigma)
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.6


def test_without_windows_what_was_expected_stays():
    nothing = seen(np.random.default_rng(6), count=0)
    fit = rigid_fit([nothing], TWIST, WEAK)
    np.testing.assert_array_equal(fit.twist, TWIST)
    assert fit.information == pytest.approx(WEAK)
