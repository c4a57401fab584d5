"""Cells of points against numpy's own way of finding them."""

import numpy as np
import pytest

from scenes.prepare.cells import cells_of


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
