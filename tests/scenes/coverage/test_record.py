"""The record of what photos saw of an object."""

import numpy as np
import pytest

from scenes.coverage.directions import bits_of, middles
from scenes.coverage.record import REACH_RAD, Coverage
from scenes.pose import Pose
from scenes.splats import SplatCloud
from scenes.state import ObjectModel


def record_of(towards, count=20):
    """The record of so many splats, all seen from the directions (K, 3)."""
    words = np.bitwise_or.reduce(bits_of(np.array(towards, dtype=float)))
    return Coverage(np.full(count, words), np.ones(count), np.zeros(6))


def test_what_a_photo_saw_is_seen_from_there_and_not_from_behind():
    seen = record_of([[1.0, 0.2, 0.5]])
    assert seen.is_seen_from(np.array([1.0, 0.2, 0.5])).all()
    assert seen.is_seen_from(np.array([1.0, 0.35, 0.45])).all()
    assert not seen.is_seen_from(np.array([-1.0, 0.2, 0.5])).any()
    assert not seen.is_seen_from(np.array([0.2, 1.0, 0.5])).any()


def test_directions_are_those_near_a_photo():
    found = record_of([[1.0, 0.0, 0.3]]).seen_directions()
    apart = np.arccos(middles() @ np.array([1.0, 0.0, 0.3]) / np.hypot(1.0, 0.3))
    assert found[apart < 0.5 * REACH_RAD].all()
    assert not found[apart > 2.0 * REACH_RAD].any()


def test_a_few_splats_seen_through_a_gap_are_no_view():
    words = np.full(100, bits_of(np.array([[1.0, 0, 0.2]]))[0])
    words[:3] |= bits_of(np.array([[-1.0, 0, 0.2]]))[0]
    found = Coverage(words, np.ones(100), np.zeros(6)).seen_directions()
    assert not found[middles()[:, 0] < -0.5].any()


def test_nothing_seen_is_no_direction():
    nothing = Coverage(np.zeros(5), np.zeros(5), np.zeros(6))
    assert not nothing.seen_directions().any()
    assert (nothing.seen_share_of_sides() == 0).all()


@pytest.mark.parametrize(
    ("directions", "weights", "sides", "said"),
    [
        (np.zeros(3), np.zeros(2), np.zeros(6), "one a splat"),
        (np.zeros((3, 2)), np.zeros((3, 2)), np.zeros(6), "one a splat"),
        (np.zeros(3), np.zeros(3), np.zeros(5), "wanted \\(6,\\)"),
        (np.zeros(3), np.array([0, -1.0, 0]), np.zeros(6), "negative or not finite"),
        (np.zeros(3), np.array([0, np.nan, 0]), np.zeros(6), "negative or not finite"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(directions, weights, sides, said):
    with pytest.raises(ValueError, match=said):
        Coverage(directions, weights, sides)


def test_an_object_takes_no_record_of_other_splats(random_cloud):
    def chair(splats: SplatCloud):
        return ObjectModel(
            "chair", "Chair", "", splats, (1.0, 1.0, 1.0), 0.0, Pose.identity(),
            coverage=record_of([[1.0, 0, 0]], 20),
        )  # fmt: skip

    assert chair(random_cloud(20, 1, 1)).coverage is not None
    with pytest.raises(ValueError, match="coverage of 20 splats, wanted of its 21"):
        chair(random_cloud(21, 1, 1))
