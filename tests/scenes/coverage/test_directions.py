"""Directions as bits: cells of one area, that turns of the object permute."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.coverage.directions import (
    DIRECTIONS,
    bits_of,
    bits_within,
    cells_of_directions,
    middles,
    packed,
    unpacked,
)
from scenes.pose import Pose


def spread(count, seed=0):
    """Directions evenly over the sphere."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_every_cell_has_the_same_share_of_the_sphere():
    count = np.bincount(cells_of_directions(spread(640_000)), minlength=DIRECTIONS)
    assert len(count) == DIRECTIONS == 64
    np.testing.assert_allclose(count, 10_000, rtol=0.06)


def test_the_middle_of_a_cell_is_in_it():
    np.testing.assert_array_equal(cells_of_directions(middles()), np.arange(DIRECTIONS))
    np.testing.assert_allclose(np.linalg.norm(middles(), axis=1), 1.0)


def test_quarter_turns_and_standing_on_ones_head_permute_cells():
    towards = spread(5000)
    for turn in (Pose.from_yaw(np.pi / 2).rotation, np.diag([1.0, 1.0, -1.0])):
        where = cells_of_directions(middles() @ turn.T)
        assert sorted(where) == list(range(DIRECTIONS))
        turned = cells_of_directions(towards @ turn.T)
        agree = turned == where[cells_of_directions(towards)]
        assert agree.mean() > 0.999  # but for those on a border to the last bit


@given(st.integers(0, 2**64 - 1))
def test_words_are_flags_and_back(word):
    words = np.array([word], dtype=np.uint64)
    flags = unpacked(words)
    assert flags.sum() == word.bit_count()
    assert packed(flags)[0] == words[0]


def test_a_direction_is_within_any_reach_of_itself_and_more_with_more_reach():
    towards = spread(300)
    own, near, far = bits_of(towards), bits_within(towards, 0.3), bits_within(towards, 0.9)
    assert ((own & near) == own).all()
    assert ((near & far) == near).all()
    assert (unpacked(far).sum(axis=1) > unpacked(own).sum(axis=1)).all()


def test_straight_up_and_no_direction_have_a_cell():
    for towards in ([0, 0, 1.0], [0, 0, -2.0], [0.0, 0, 0], [1e-200, 0, 0]):
        assert 0 <= cells_of_directions(np.array(towards))[0] < DIRECTIONS
