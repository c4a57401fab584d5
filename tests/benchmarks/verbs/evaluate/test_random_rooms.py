"""`nexus evaluate random-rooms`: which seeds are meant, and what is refused."""

import pytest

from benchmarks.verbs.evaluate.random_rooms import seeds_of


def test_seeds_are_a_range_or_one():
    assert seeds_of("200-203") == [200, 201, 202, 203]
    assert seeds_of(" 7 ") == [7]


@pytest.mark.parametrize("text", ["", "a-b", "9-3", "-4", "1-2-3", "0-500", "2000000"])
def test_other_seeds_are_refused_with_what_is_wanted(text):
    with pytest.raises(ValueError, match="--seeds"):
        seeds_of(text)
