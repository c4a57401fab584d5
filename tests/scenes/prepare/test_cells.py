"""Cells of points and near points against numpy's own way of finding them."""

import numpy as np
import pytest

from scenes.prepare.cells import cells_of, nearest, pairs_within


@pytest.mark.parametrize("spread", [1.0, 30.0, 1e9])
def test_they_are_those_that_numpy_finds_row_by_row(spread):
    points = np.random.default_rng(0).normal(scale=spread, size=(4000, 3))
    side = 0.25
    wanted, cell = np.unique(np.floor(points / side).astype(int), axis=0, return_inverse=True)
    found, mine = cells_of(points, side)
    np.testing.assert_array_equal(found, wanted)
    np.testing.assert_array_equal(mine, cell.ravel())


def test_no_points_lie_in_no_cells():
    cells, cell = cells_of(np.zeros((0, 3)), 1.0)
    assert cells.shape == (0, 3)
    assert cell.shape == (0,)


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(0, 1, (60, 3))


@pytest.mark.parametrize("count", [1, 4, 100])
def test_they_are_the_nearest_of_all(points, count):
    places = points[:7] + 0.01
    apart, which = nearest(places, points, count=count)
    every = np.linalg.norm(places[:, None] - points, axis=2)
    assert apart.shape == which.shape == (7, min(count, 60))
    np.testing.assert_allclose(apart, np.sort(every, axis=1)[:, : min(count, 60)])
    np.testing.assert_allclose(np.take_along_axis(every, which, axis=1), apart)


def test_pairs_are_all_that_are_near(points):
    first, second = pairs_within(points, 0.2)
    every = np.linalg.norm(points[:, None] - points, axis=2)
    wanted = {(a, b) for a, b in np.argwhere(every <= 0.2) if a < b}
    assert set(zip(first.tolist(), second.tolist(), strict=True)) == wanted
