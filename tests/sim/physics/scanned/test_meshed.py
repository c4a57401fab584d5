"""Meshes of what a headset alone sees."""

import numpy as np
import pytest

from sim.physics.scanned.meshed import WELDED_M, _welded


@pytest.mark.parametrize("size_m", [5.0, 5000.0], ids=["room", "farther than any room"])
def test_corners_at_one_place_become_one(size_m):
    rng = np.random.default_rng(2)
    places = rng.uniform(-size_m, size_m, (300, 3))
    which = rng.integers(0, 300, 2000)
    corners = places[which] + rng.uniform(-1e-6, 1e-6, (2000, 3))
    found, index = _welded(corners)
    assert np.abs(found[index] - corners).max() <= 0.51 * WELDED_M
    wanted = np.unique(np.round(corners / WELDED_M), axis=0)
    np.testing.assert_allclose(found, WELDED_M * wanted)


def test_nothing_becomes_nothing():
    found, index = _welded(np.zeros((0, 3)))
    assert found.shape == (0, 3)
    assert index.shape == (0,)
