"""What a surface says about its photo's pixels, at another size."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.train.depth.seen_surfaces import Surface
from scenes.prepare.train.training_photos import LENT_SLACK, SEEN_SLACK, depth_bounds
from scenes.render.training import FARTHEST

SMALL = Pinhole.from_fov(30, 20, 1.2)


@pytest.fixture
def surface():
    """A wall seen on the left, lent in the middle, filled in on the right."""
    column = np.broadcast_to(np.arange(30), (20, 30))
    return Surface(
        "wall",
        SMALL,
        Pose.identity(),
        np.zeros((20, 30, 3), np.uint8),
        np.full((20, 30), 2.0, np.float32),
        column < 10,
        (column >= 10) & (column < 20),
    )


@pytest.mark.parametrize("times", [1, 2, 3])
def test_bounds_are_tight_where_seen_and_open_where_filled_in(surface, times):
    camera = Pinhole.from_fov(30 * times, 20 * times, 1.2)
    bounds = depth_bounds(surface, camera)
    assert bounds.near.shape == bounds.far.shape == (20 * times, 30 * times)
    assert bounds.near.dtype == bounds.far.dtype == np.float32
    for column, slack in ((5, SEEN_SLACK), (15, LENT_SLACK)):
        np.testing.assert_allclose(bounds.near[:, times * column], 2 * (1 - slack), rtol=1e-6)
    assert (bounds.near[:, 25 * times] == 0).all()
    np.testing.assert_allclose(bounds.far[:, 5 * times], 2 * (1 + SEEN_SLACK), rtol=1e-6)
    np.testing.assert_allclose(bounds.far[:, 15 * times], 2 * (1 + LENT_SLACK), rtol=1e-6)
    assert (bounds.far[:, 25 * times] == FARTHEST).all()
