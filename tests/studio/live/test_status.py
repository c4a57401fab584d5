"""The journal hands its notes to one picture, and keeps what came with pictures."""

from __future__ import annotations

from devices.clock import ManualClock
from studio.live.status import Journal, LiveState


def test_notes_wait_for_a_picture_and_are_taken_once():
    clock = ManualClock(5)
    journal = Journal(clock)
    assert journal.state is LiveState.CONNECTING
    journal.note("changed", "layout")
    clock.sleep_until(9)
    journal.note("live", "the session is live")
    assert journal.events() == ()
    taken = journal.take_notes()
    assert [(event.t_ns, event.kind) for event in taken] == [(5, "changed"), (9, "live")]
    assert journal.take_notes() == ()
    journal.add(taken)
    assert journal.events() == taken


def test_the_last_sentence_counts():
    journal = Journal(ManualClock(0))
    journal.say(LiveState.PLACING, "looking for the camera")
    journal.say(LiveState.FINDING, "finding the objects")
    assert (journal.state, journal.text) == (LiveState.FINDING, "finding the objects")
