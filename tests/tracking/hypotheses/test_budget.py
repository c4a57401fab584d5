"""A long computation that is spread over frames."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.hypotheses.budget import NotYet, Pace


def cost_ms(number):
    return 1 + number % 7


def long_sum(numbers, pace, log):
    def squared(number):
        log.append(number)
        return number * number

    total = 0
    for number in numbers:
        total += pace.do(cost_ms(number), squared, number)
    return total


def test_without_a_limit_all_is_done_at_once():
    log = []
    assert long_sum([1, 2, 3], Pace(), log) == 14
    assert log == [1, 2, 3]


@given(st.lists(st.integers(0, 30)), st.floats(0.0, 20.0))
def test_spread_over_frames_it_comes_to_the_same_and_nothing_is_done_twice(numbers, budget_ms):
    log, done, frames = [], (), 0
    while True:
        pace, before = Pace(budget_ms, done), len(log)
        try:
            found = long_sum(numbers, pace, log)
            break
        except NotYet:
            done, frames = pace.done(), frames + 1
            spent = [cost_ms(number) for number in log[before:]]
            assert spent, "every frame does something"
            assert sum(spent) <= max(budget_ms, spent[0])
    assert found == sum(number * number for number in numbers)
    assert log == numbers
    assert frames <= len(numbers)


def test_what_does_not_fit_any_more_waits_and_what_was_begun_from_stays_as_it_was():
    log = []
    first = Pace(5.0)
    with pytest.raises(NotYet):
        long_sum([3, 3], first, log)
    done = first.done()
    assert done == (9,)
    assert long_sum([3, 3], Pace(5.0, done), log) == 18
    assert long_sum([3, 3], Pace(5.0, done), log) == 18
    assert done == (9,)
    assert log == [3, 3, 3]
