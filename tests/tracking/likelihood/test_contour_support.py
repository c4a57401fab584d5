"""Contour points whose errors are noise, or those of a scan."""

import numpy as np
import pytest

from tracking.likelihood.contour_support import shared_errors

CORNER = np.linspace(0.0, 2 * np.pi, 200, endpoint=False)
PIXELS = 60.0 * np.stack([np.cos(CORNER), np.sin(CORNER)], axis=1)


def test_errors_of_their_own_are_not_alike():
    residuals = np.random.default_rng(1).normal(size=200)
    assert shared_errors(PIXELS, residuals) == 1.0


def test_a_side_that_is_off_makes_its_points_say_less():
    noise = np.random.default_rng(2).normal(size=200)
    off = np.where(PIXELS[:, 0] > 0.0, 2.0, -2.0)
    assert shared_errors(PIXELS, noise + off) > 2.0


def test_the_size_of_errors_does_not_matter():
    residuals = np.sin(3.0 * CORNER)
    assert shared_errors(PIXELS, residuals) == pytest.approx(shared_errors(PIXELS, 5.0 * residuals))


def test_of_few_points_nothing_is_told():
    assert shared_errors(PIXELS[:5], np.ones(5)) == 1.0
