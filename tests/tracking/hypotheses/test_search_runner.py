"""A search has one result, in the frame that its runner gives it in."""

import pytest

from tracking.hypotheses.budget import NOMINAL_COSTS, Step
from tracking.hypotheses.search_runner import BEGUN, IN_FRAMES, SearchAsRecorded


def work(budget):
    return sum(budget.do(Step.ALIGN, abs, k) for k in range(6))


def frames_of(runner, budget_ms, before=lambda frame: None):
    progress, result, frames = BEGUN, None, 0
    while result is None:
        before(frames)
        progress, result = runner.advance(progress, work, budget_ms=budget_ms)
        frames += 1
    assert result == 15
    return frames


@pytest.mark.parametrize(("steps", "frames"), [(1, 6), (2, 3), (4, 2), (6, 1)])
def test_in_frames_the_budget_decides_when(steps, frames):
    assert frames_of(IN_FRAMES, steps * Step.ALIGN.nominal_ms) == frames
    IN_FRAMES.give_up(BEGUN)


@pytest.mark.parametrize("end", [0, 3])
def test_as_recorded_it_ends_where_it_ended(end):
    runner = SearchAsRecorded(NOMINAL_COSTS)
    frames = frames_of(runner, 1.0, lambda frame: runner.give(ends=frame == end))
    assert frames == end + 1
    runner.give_up(BEGUN)


def test_an_older_recording_took_a_share_of_each_frame():
    runner = SearchAsRecorded(NOMINAL_COSTS)
    runner.give(ends=None)
    assert frames_of(runner, 2 * Step.ALIGN.nominal_ms) == 3
