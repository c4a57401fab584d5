"""Dropping, splitting, sorting."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.pose import rotation_from_quaternion
from scenes.prepare.train.optimiser.densify import FAINT_OPACITY, densify, morton_order
from scenes.prepare.train.optimiser.rows import (
    LOG_SCALE,
    LOGIT,
    MEAN,
    ROTATION,
    TrainingRows,
    fresh_rows,
)


def rows_of(n=200, seed=0):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(n, 14)).astype(np.float32)
    rows = fresh_rows(values)
    return TrainingRows(
        rows.values,
        rng.normal(size=values.shape).astype(np.float32),
        rows.second + 1,
        rows.steps + np.uint32(5),
        rng.uniform(0, 1, n).astype(np.float32),
    )


@given(wanted=st.integers(0, 600), seed=st.integers(0, 5))
def test_there_are_as_many_as_wanted_or_each_was_split_once(wanted, seed):
    rows = rows_of(seed=seed)
    after = densify(rows, wanted, np.random.default_rng(seed))
    assert len(after) == min(max(wanted, len(rows)), 2 * len(rows))
    assert (after.error == 0).all()


def test_faint_and_damaged_splats_go():
    rows = rows_of()
    rows.values[:50, LOGIT] = np.log(FAINT_OPACITY / 2)
    rows.values[50:60, 0] = np.nan
    after = densify(rows, 0, np.random.default_rng(0))
    np.testing.assert_array_equal(after.values, rows.values[60:])


def test_what_shows_error_is_split_and_the_rest_keeps_its_momentum():
    rows = rows_of()
    rows.error[:] = 0
    rows.error[7] = 1
    after = densify(rows, len(rows) + 1, np.random.default_rng(0))
    others = np.arange(len(rows)) != 7
    np.testing.assert_array_equal(after.values[:-2], rows.values[others])
    np.testing.assert_array_equal(after.first[:-2], rows.first[others])
    assert (after.steps[-2:] == 0).all()
    assert (after.first[-2:] == 0).all()


def test_halves_lie_on_the_longest_axis_within_the_whole():
    rows = rows_of(1)
    rows.error[:] = 1
    whole, halves = rows.values[0], densify(rows, 2, np.random.default_rng(0)).values
    scales = np.exp(whole[LOG_SCALE])
    longest = scales.argmax()
    axis = rotation_from_quaternion(whole[ROTATION].astype(np.float64))[:, longest]
    np.testing.assert_allclose(halves[:, MEAN].mean(axis=0), whole[MEAN], atol=1e-6)
    apart = (halves[1, MEAN] - halves[0, MEAN]) / scales[longest]
    np.testing.assert_allclose(abs(apart @ axis), np.linalg.norm(apart), rtol=1e-4)
    # Both together spread as the whole does along that axis, to a fifth.
    spread = np.exp(2 * halves[0, LOG_SCALE.start + longest]) / scales[longest] ** 2
    spread += (np.linalg.norm(apart) / 2) ** 2
    assert 0.7 < spread < 1.1
    others = np.arange(3) != longest
    np.testing.assert_array_equal(halves[0, LOG_SCALE][others], whole[LOG_SCALE][others])


def test_neighbours_end_up_together():
    rng = np.random.default_rng(0)
    means = rng.uniform(-3, 5, (4096, 3)).astype(np.float32)
    order = morton_order(means)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(means)))

    def mean_size(ordered):
        return np.ptp(ordered.reshape(-1, 64, 3), axis=1).mean()

    assert mean_size(means[order]) < 0.4 * mean_size(means)


def test_the_eight_corners_come_in_z_order():
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    shuffled = np.random.default_rng(0).permutation(8)
    order = morton_order(corners[shuffled].astype(np.float32))
    np.testing.assert_array_equal(shuffled[order], np.arange(8))
