"""Adam for what is seen."""

import numpy as np

from scenes.prepare.train.optimiser.rows import fresh_rows
from tests.twins import adam

RATES = np.linspace(0.001, 0.02, 14).astype(np.float32)


def test_the_first_step_is_as_long_as_the_rate_whatever_the_slope():
    rows = fresh_rows(np.zeros((3, 14), dtype=np.float32))
    slope = np.array([[1e-8], [-3.0], [1e4]]) * np.ones(14)
    after = adam.step(rows, slope, np.ones(3, dtype=bool), RATES)
    np.testing.assert_allclose(after.values, -np.sign(slope) * RATES, rtol=1e-5)


def test_what_is_not_seen_stays_and_does_not_age():
    rows = fresh_rows(np.ones((4, 14), dtype=np.float32))
    seen = np.array([True, False, True, False])
    after = adam.step(rows, np.full((4, 14), 0.5), seen, RATES)
    np.testing.assert_array_equal(after.steps, [1, 0, 1, 0])
    np.testing.assert_array_equal(after.values[~seen], 1)
    np.testing.assert_array_equal(after.first[~seen], 0)
    assert (after.values[seen] < 1).all()


def test_it_finds_a_minimum():
    rows = fresh_rows(np.ones((1, 14), dtype=np.float32))
    for _ in range(400):
        slope = 2 * (rows.values.astype(np.float64) - 0.25)
        rows = adam.step(rows, slope, np.ones(1, dtype=bool), np.full(14, 0.02, dtype=np.float32))
    np.testing.assert_allclose(rows.values, 0.25, atol=0.01)
