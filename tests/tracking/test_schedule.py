"""What no frame needs at once is done in turn, less often while frames are late, but never not."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from tracking.schedule import LATE_FRAMES, PUT_OFF_FRAMES, Rota


def rotas(numbers: Sequence[int]) -> list[Rota]:
    """Of frames with these numbers in their stream."""
    seen = [Rota(numbers[0])]
    for seq in numbers[1:]:
        seen.append(seen[-1].following(seq))
    return seen


def turns(seen: Sequence[Rota]) -> list[list[int]]:
    """Whose turn it was: of what is measured, learned and looked through."""
    kinds = ([rota.measures, rota.learns, rota.watches] for rota in seen)
    measured, learned, watched = zip(*kinds, strict=True)
    return [[turn for turn in kind if turn is not None] for kind in (measured, learned, watched)]


def test_a_stream_that_keeps_pace_has_everything_done_in_turn() -> None:
    seen = rotas(range(100, 180))
    assert turns(seen) == [list(range(20)), list(range(20)), list(range(10))]
    for rota in seen:
        due = [rota.measures, rota.learns, rota.watches]
        assert sum(turn is not None for turn in due) == (not rota.is_free)


def test_a_dropped_picture_puts_off_what_is_due_for_a_while() -> None:
    numbers = [*range(10), *range(11, 200)]
    seen = rotas(numbers)
    late = [rota for rota in seen if 11 <= rota.seq <= 11 + LATE_FRAMES]
    done = sum(not rota.is_free and not rota.put_off for rota in late)
    assert 1 <= done <= len(late) // 5
    after = [rota for rota in seen if rota.seq > 11 + LATE_FRAMES]
    assert not any(rota.put_off for rota in after[PUT_OFF_FRAMES:])


@given(st.lists(st.integers(1, 4), min_size=60, max_size=200))
def test_nothing_is_left_out_or_waits_for_ever(steps: list[int]) -> None:
    numbers = [0]
    for step in steps:
        numbers.append(numbers[-1] + step)
    seen = rotas(numbers)
    assert [rota.pictures for rota in seen[1:]] == steps
    for kind in turns(seen):
        assert kind == list(range(len(kind)))
        assert kind
    assert max(rota.put_off for rota in seen) <= PUT_OFF_FRAMES
    assert [rota.is_first for rota in seen] == [True, *([False] * len(steps))]


def test_a_stream_that_begins_anew_is_not_late() -> None:
    assert not any(rota.put_off for rota in rotas([500, 501, 0, 1, 2, 3, 4, 5, 6, 7, 8]))
