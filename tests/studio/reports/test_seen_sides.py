"""Sides of an object that photos saw, in words that stay as they are."""

import math

import numpy as np
import pytest

from scenes.coverage.directions import bits_of
from scenes.coverage.record import Coverage
from scenes.prepare.cutout.coverage.standpoints import Advice, Standpoint
from studio.reports.seen_sides import advice_lines, seen_sides, standpoint_words

WHOLE = np.uint64(2**64 - 1)
HALF = np.uint64(2**32 - 1)


def record(towards, sides):
    words = np.bitwise_or.reduce(bits_of(np.array(towards, dtype=float)))
    return Coverage(np.full(10, words), np.ones(10), np.array(sides, dtype=np.uint64))


SEEN_FROM_PLUS_Y = record(
    [[0.1, 1, 0.3], [0.6, 0.8, 0.3], [-0.5, 0.8, 0.4]], [HALF, 3, WHOLE, 0, WHOLE, 0]
)


def test_sides_are_named_from_the_one_that_photos_saw_most_of():
    seen = seen_sides(SEEN_FROM_PLUS_Y)
    assert seen.front_rad == pytest.approx(math.pi / 2)
    # Who stands at +y and looks at the object has -x at their right.
    shares = {"front": 1.0, "back": 0.0, "left": 0.5, "right": 2 / 64, "top": 1.0, "bottom": 0.0}
    assert dict(seen.sides) == pytest.approx(shares)


def test_the_sentence_of_an_object_seen_from_one_side():
    assert seen_sides(SEEN_FROM_PLUS_Y).sentence() == (
        "seen from 16 % of directions; not from behind, not from the right, not from below"
    )


def test_an_object_of_which_nothing_is_missing_and_one_that_nobody_saw():
    all_round = record(np.random.default_rng(1).normal(size=(500, 3)), [WHOLE] * 6)
    assert seen_sides(all_round).sentence() == "seen from 100 % of directions"
    unseen = seen_sides(record([[0, 0, 1]], [0] * 6))
    assert unseen.sentence().count("not from") == 6
    little = seen_sides(record([[1, 0, 0.2]], [WHOLE, 0xFFFF, 0, 0, 0, 0]))
    assert "hardly from behind" in little.sentence()


@pytest.mark.parametrize(
    ("bearing_deg", "where"),
    [
        (90, "in front of it"),
        (180, "to its right"),
        (140, "in front of it to the right"),
        (0, "to its left"),
        (270, "behind it"),
        (225, "behind it to the right"),
        (312, "behind it to the left"),
        (-315, "in front of it to the left"),
    ],
)
def test_places_are_named_from_the_front(bearing_deg, where):
    at = Standpoint((1.234, -0.5, 1.4), math.radians(bearing_deg), 1.0, 1.4, 0.314)
    assert standpoint_words(at, seen_sides(SEEN_FROM_PLUS_Y)) == (
        f"stand {where}, 1.0 m from it, camera 1.4 m high, at (1.23, -0.50) m, where the floor is "
        "free: shows 31 % more of it"
    )


def test_advice_numbers_the_photos_and_says_what_none_can_show():
    seen = seen_sides(SEEN_FROM_PLUS_Y)
    at = Standpoint((0.0, -2.0, 0.8), math.radians(270), 1.5, 0.8, 0.2)
    first, second = advice_lines(Advice((at,), 0.3, 0.1), seen)
    assert first.startswith("1. stand behind it, 1.5 m from it")
    assert second == (
        "10 % of it then shows from no free place on the floor: turn or move it, and film it there"
    )
    assert advice_lines(Advice((), 0.01, 0.01), seen) == [
        "photos saw all of it that can be seen where it stands"
    ]
    assert advice_lines(Advice((), 0.2, 0.2), seen)[0].startswith("20 % of it shows from no free")
    assert len(advice_lines(Advice((at,), 0.2, 0.0), seen)) == 1
