"""What a stranger wants on the first day is done by mouse within eight clicks, with no dead end."""

import numpy as np
import pytest

from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def hand(desk):
    from benchmarks.studio.tasks.first_time import Hand

    desk.window.resize(1380, 860)
    return Hand(desk.window, desk.until)


def within(hand, limit=8):
    """The clicks of a task, counted anew from here."""
    clicks, hand.clicks = hand.clicks, 0
    assert 0 < clicks <= limit
    return clicks


def test_own_splats_become_a_room(hand, tmp_path):
    from benchmarks.studio.tasks.first_time import open_own_splats, own_splats
    from scenes.package import load_package

    own_splats(tmp_path / "own.ply")
    open_own_splats(hand, tmp_path / "own.ply")
    within(hand)
    package = load_package(tmp_path / "own.gnx")
    assert package.collision is not None
    low, high = np.percentile(package.room.means, (1, 99), axis=0)
    assert np.sort(high - low) == pytest.approx([2.6, 3.2, 4.0], abs=0.1)


def test_a_room_is_arranged_rehearsed_twice_and_the_first_run_found(hand):
    from benchmarks.studio.tasks.first_time import arrange, find_the_first_run, rehearse

    arrange(hand, "Chair 1")
    within(hand)
    first = rehearse(hand)
    within(hand)
    assert rehearse(hand) != first
    within(hand)
    find_the_first_run(hand, first)
    within(hand)


@pytest.mark.slow
def test_every_task_of_the_first_day_takes_eight_clicks_at_most(tmp_path):
    from benchmarks.studio.tasks.first_time import first_time

    found = first_time(str(tmp_path))
    assert found["dead_ends"] == []
    assert list(found["clicks"]) == [
        "open_own_splats", "cut", "arrange", "rehearse", "rehearse_again", "find_first_run",
        "fork_and_compare", "share",
    ]  # fmt: skip
    assert max(found["clicks"].values()) <= 8
