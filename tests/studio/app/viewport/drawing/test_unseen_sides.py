"""The parts of a box that no photo saw, as squares."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.coverage.record import Coverage
from scenes.pose import Pose
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from studio.app.viewport.layers import OUTSIDE_M, unseen_squares

SIZE_M = (0.4, 0.6, 0.8)
WHOLE = 2**64 - 1


@pytest.fixture
def item():
    turns = np.tile([1.0, 0, 0, 0], (4, 1))
    splats = SplatCloud(np.zeros((4, 3)), np.ones((4, 3)), turns, np.ones(4), np.zeros((4, 1, 3)))
    return ObjectModel("box", "Box", "", splats, SIZE_M, 0.0, Pose.identity())


def seen(item, *sides):
    nothing = np.zeros(4)
    return replace(item, coverage=Coverage(nothing, nothing, np.array(sides, dtype=np.uint64)))


def test_the_unseen_side_is_filled_and_turned_with_the_object(item):
    squares = unseen_squares(seen(item, WHOLE, 0, WHOLE, WHOLE, WHOLE, 0), Pose.identity())
    assert squares.corners.shape == (64, 4, 3)
    np.testing.assert_allclose(squares.corners[..., 0], -0.2 - OUTSIDE_M)
    low, high = squares.corners.min(axis=(0, 1)), squares.corners.max(axis=(0, 1))
    np.testing.assert_allclose([low[1:], high[1:]], [[-0.3, 0.0], [0.3, 0.8]], atol=1e-12)
    a, b, _, d = squares.corners.transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, d - a), axis=1).sum()
    assert area == pytest.approx(0.6 * 0.8)
    pose = Pose.from_yaw(0.7, (1.0, 2.0, 0.1))
    turned = unseen_squares(seen(item, WHOLE, 0, WHOLE, WHOLE, WHOLE, 0), pose)
    np.testing.assert_allclose(turned.corners[5], pose @ squares.corners[5])


def test_nothing_is_drawn_of_what_is_seen_or_unknown_or_stood_upon(item):
    assert unseen_squares(item, Pose.identity()) is None
    assert unseen_squares(seen(item, *[WHOLE] * 5, 0), Pose.identity()) is None
    one = unseen_squares(seen(item, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE - 1, 0), Pose.identity())
    assert len(one.corners) == 1
