"""Small pictures are drawn in turn, in a bounded share of the time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.app.viewport.insets.turns import SHARE, Turns, rest_s


def test_the_latest_request_of_a_key_counts_and_is_drawn_once():
    turns = Turns()
    turns.ask("ana", 1)
    turns.ask("ana", 2)
    assert turns.next() == ("ana", 2)
    assert turns.next() is None


@given(st.lists(st.sampled_from(["ana", "ben", "chair-1"]), max_size=60))
def test_nobody_who_asks_waits_for_more_than_the_others_once(asking):
    turns, waiting = Turns(), {}
    for key in asking:
        turns.ask(key, None)
        waiting.setdefault(key, 0)
        if len(waiting) == 3:  # all want a picture, again and again
            drawn, _ = turns.next()
            del waiting[drawn]
            waiting = {other: turns_missed + 1 for other, turns_missed in waiting.items()}
            assert all(missed <= 2 for missed in waiting.values())


def test_a_key_that_was_closed_is_not_drawn():
    turns = Turns()
    turns.ask("ana", 1)
    turns.ask("ben", 2)
    assert turns.next() == ("ana", 1)
    turns.ask("ana", 3)
    turns.forget("ana")
    turns.forget("nobody")
    assert turns.next() == ("ben", 2)
    assert turns.next() is None


@given(st.floats(1e-4, 5.0))
def test_drawing_takes_its_share_of_the_time(took):
    assert took / (took + rest_s(took)) == pytest.approx(SHARE)
