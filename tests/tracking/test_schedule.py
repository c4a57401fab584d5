"""Work that no frame needs at once is done in turn, less often while frames are late."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from tracking.schedule import LATE_FRAMES, MAX_DEFERRED_FRAMES, Schedule


def schedules(numbers: Sequence[int]) -> list[Schedule]:
    """Of frames with these numbers in their stream."""
    seen = [Schedule(numbers[0])]
    for seq in numbers[1:]:
        seen.append(seen[-1].following(seq))
    return seen


def turns(seen: Sequence[Schedule]) -> list[list[int]]:
    """Turns that came: of measurements and of bands to learn."""
    kinds = ([schedule.measures, schedule.learns] for schedule in seen)
    measured, learned = zip(*kinds, strict=True)
    return [[turn for turn in kind if turn is not None] for kind in (measured, learned)]


def test_a_stream_that_keeps_pace_has_everything_done_in_turn() -> None:
    seen = schedules(range(100, 180))
    assert turns(seen) == [list(range(20)), list(range(20))]
    for schedule in seen:
        due = [schedule.measures, schedule.learns]
        assert sum(turn is not None for turn in due) == (not schedule.is_free)


def test_a_dropped_picture_defers_what_is_due_for_a_while() -> None:
    numbers = [*range(10), *range(11, 200)]
    seen = schedules(numbers)
    late = [schedule for schedule in seen if 11 <= schedule.seq <= 11 + LATE_FRAMES]
    done = sum(not schedule.is_free and not schedule.deferred for schedule in late)
    assert 1 <= done <= len(late) // 5
    after = [schedule for schedule in seen if schedule.seq > 11 + LATE_FRAMES]
    assert not any(schedule.deferred for schedule in after[MAX_DEFERRED_FRAMES:])


@given(st.lists(st.integers(1, 4), min_size=60, max_size=200))
def test_nothing_is_left_out_or_waits_for_ever(steps: list[int]) -> None:
    numbers = [0]
    for step in steps:
        numbers.append(numbers[-1] + step)
    seen = schedules(numbers)
    assert [schedule.pictures for schedule in seen[1:]] == steps
    for kind in turns(seen):
        assert kind == list(range(len(kind)))
        assert kind
    assert max(schedule.deferred for schedule in seen) <= MAX_DEFERRED_FRAMES
    assert [schedule.is_first for schedule in seen] == [True, *([False] * len(steps))]


def test_a_stream_that_begins_anew_is_not_late() -> None:
    assert not any(
        schedule.deferred for schedule in schedules([500, 501, 0, 1, 2, 3, 4, 5, 6, 7, 8])
    )
