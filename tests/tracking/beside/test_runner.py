"""Searches in a real process beside the frames: results, failures, deaths, ends."""

import os
import time
import weakref
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.tracking.beside.orders import (
    dies,
    doubled,
    endless,
    fails,
    process_id,
    scattered,
)
from tracking.beside.runner import MAX_DEATHS, SearchBesideFrames, SearchProcessError
from tracking.hypotheses.search_runner import BEGUN

PATIENCE_S = 60.0
"""Seconds that a process may take to start on a busy machine."""


@pytest.fixture
def runner():
    made = SearchBesideFrames()
    yield made
    made.close()


def result_of(runner, work, progress=BEGUN):
    """The result of a search, and how many frames it took."""
    until, frames = time.monotonic() + PATIENCE_S, 0
    while time.monotonic() < until:
        progress, result = runner.advance(progress, work, budget_ms=1.0)
        frames += 1
        if result is not None:
            return result, frames
        time.sleep(0.01)
    raise AssertionError("no result")


def resident_mb(number):
    pages = int(Path(f"/proc/{number}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def is_running(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_search_is_computed_elsewhere_while_frames_go_on(runner):
    result, frames = result_of(runner, partial(doubled, np.arange(5.0)))
    np.testing.assert_array_equal(result, 2 * np.arange(5.0))
    assert frames > 1
    number, _ = result_of(runner, process_id)
    assert number != os.getpid()
    assert result_of(runner, process_id)[0] == number


@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="this system has no niceness")
@pytest.mark.parametrize("niceness", [0, 10])
def test_it_is_as_urgent_as_is_asked_for(niceness):
    runner = SearchBesideFrames(niceness)
    try:
        number, _ = result_of(runner, process_id)
        own = os.getpriority(os.PRIO_PROCESS, 0)
        assert os.getpriority(os.PRIO_PROCESS, number) == min(own + niceness, 19)
    finally:
        runner.close()


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="/proc says how much is used")
def test_nothing_of_a_search_stays_in_memory(runner):
    """Neither what came with it nor the many arrays that it made."""
    number, _ = result_of(runner, process_id)
    before = resident_mb(number)
    pictures = np.zeros(150_000_000, np.uint8)
    assert result_of(runner, partial(scattered, pictures))[0] == 150_000_000
    until = time.monotonic() + PATIENCE_S
    while resident_mb(number) > before + 20 and time.monotonic() < until:
        time.sleep(0.01)
    assert resident_mb(number) < before + 20
    here = weakref.ref(pictures)
    del pictures
    assert here() is None


def test_whether_one_has_ended_is_said_once(runner):
    assert not runner.has_ended()
    result_of(runner, process_id)
    assert runner.has_ended()
    assert not runner.has_ended()


def test_one_that_is_given_up_does_not_hold_up_the_next(runner):
    progress, nothing = runner.advance(BEGUN, endless, budget_ms=1.0)
    assert nothing is None
    runner.give_up(progress)
    assert len(result_of(runner, partial(doubled, np.ones(3)))[0]) == 3


def test_two_trackers_have_their_own_searches(runner):
    first, _ = runner.advance(BEGUN, partial(doubled, np.ones(1)), budget_ms=1.0)
    second, _ = runner.advance(BEGUN, partial(doubled, np.ones(2)), budget_ms=1.0)
    assert len(result_of(runner, None, second)[0]) == 2
    assert len(result_of(runner, None, first)[0]) == 1


def test_what_a_search_raises_reaches_the_session(runner):
    with pytest.raises(SearchProcessError, match=r"no floor at 2\.5 m"):
        result_of(runner, fails)


def test_a_process_that_dies_is_started_again_and_its_search_begun_anew(runner):
    number, _ = result_of(runner, process_id)
    progress, _ = runner.advance(BEGUN, partial(doubled, np.ones(4)), budget_ms=1.0)
    runner.advance(BEGUN, dies, budget_ms=1.0)
    assert len(result_of(runner, partial(doubled, np.ones(4)), progress)[0]) == 4
    again, _ = result_of(runner, process_id)
    assert again not in (number, os.getpid())
    assert not is_running(number)


def test_after_many_deaths_searches_are_computed_in_the_frames(runner, caplog):
    progress, until = BEGUN, time.monotonic() + PATIENCE_S
    for _ in range(MAX_DEATHS):
        runner.advance(BEGUN, dies, budget_ms=1.0)
        process = runner._process
        while not process.is_dead and time.monotonic() < until:
            time.sleep(0.01)
    runner.has_ended()
    result, frames = result_of(runner, process_id, progress)
    assert (result, frames) == (os.getpid(), 1)
    assert runner.has_ended()
    assert "search process died 3 times" in caplog.text


def test_nothing_is_left_after_the_end(runner):
    number, _ = result_of(runner, process_id)
    runner.advance(BEGUN, endless, budget_ms=1.0)
    runner.close()
    assert not is_running(number)
