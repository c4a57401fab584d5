"""What waits to be decoded: in order, bounded, and nothing that a newer keyframe makes useless."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from devices.camera.decoding import Arrived, Backlog
from devices.camera.units import StreamFormat, Unit

FORMAT = StreamFormat("h264")


def unit(*, keyframe: bool = False, track: int = 0, size: int = 10) -> Unit:
    return Unit(FORMAT, bytes(size), keyframe, None, track)


def filled(backlog: Backlog, keyframes: str, track: int = 0) -> Backlog:
    """Puts a unit a letter: K a keyframe, P another one."""
    for number, letter in enumerate(keyframes):
        backlog.put(Arrived(unit(keyframe=letter == "K", track=track), number, number))
    return backlog


def numbers(backlog: Backlog) -> list[int]:
    backlog.close(finish=True)
    out: list[int] = []
    while (arrived := backlog.take()) is not None:
        out.append(arrived.number)
    return out


def test_units_come_out_in_order():
    backlog = filled(Backlog(1), "KPPP")
    assert numbers(backlog) == [0, 1, 2, 3]
    assert backlog.skipped == 0


def test_a_keyframe_replaces_what_waits():
    backlog = filled(Backlog(1), "KPPKP")
    arrived = backlog.take()
    assert arrived is not None
    assert (arrived.number, arrived.after_gap) == (3, True)
    assert numbers(backlog) == [4]
    assert backlog.skipped == 3


def test_a_keyframe_replaces_nothing_where_nothing_waits():
    backlog = filled(Backlog(1), "K")
    assert backlog.take() is not None
    backlog.put(Arrived(unit(keyframe=True), 1, 1))
    arrived = backlog.take()
    assert arrived is not None
    assert not arrived.after_gap
    assert backlog.skipped == 0


def test_too_many_bytes_are_given_up_to_the_next_keyframe():
    backlog = filled(Backlog(1, max_bytes=35), "KPPPPP")
    assert backlog.skipped == 6
    backlog.put(Arrived(unit(keyframe=True), 6, 6))
    assert numbers(backlog) == [6]


def test_several_tracks_start_with_the_first_after_a_gap():
    backlog = Backlog(2, max_bytes=35)
    kinds = [(0, "K"), (1, "K"), (0, "P"), (1, "P"), (0, "P"), (1, "K"), (0, "K"), (1, "K")]
    for number, (track, kind) in enumerate(kinds):
        backlog.put(Arrived(unit(keyframe=kind == "K", track=track), number, 0))
    assert numbers(backlog) == [6, 7]


def test_keyframes_of_several_tracks_replace_nothing():
    backlog = Backlog(2)
    for number in range(6):
        backlog.put(Arrived(unit(keyframe=True, track=number % 2), number, 0))
    assert numbers(backlog) == list(range(6))


def test_after_its_end_it_takes_nothing_and_gives_nothing_unless_it_is_to_finish():
    backlog = filled(Backlog(1), "KP")
    backlog.close(finish=False)
    filled(backlog, "K")
    assert backlog.take() is None


@given(
    st.lists(st.tuples(st.booleans(), st.integers(1, 40), st.booleans()), max_size=60),
    st.integers(1, 100),
)
def test_what_is_taken_can_be_decoded_and_memory_is_bounded(steps, max_bytes):
    """Units but keyframes follow directly on the one before them; nothing is lost uncounted."""
    backlog = Backlog(1, max_bytes=max_bytes)
    taken: list[Arrived] = []
    waiting = 0
    for number, (keyframe, size, takes) in enumerate(steps):
        backlog.put(Arrived(unit(keyframe=keyframe or number == 0, size=size), number, 0))
        waiting = number + 1 - backlog.skipped - len(taken)
        assert waiting >= 0
        if takes and waiting:
            arrived = backlog.take()
            assert arrived is not None
            taken.append(arrived)
    backlog.close(finish=True)
    left = 0
    while (arrived := backlog.take()) is not None:
        taken.append(arrived)
        left += len(arrived.unit.data)
    assert left <= max_bytes or left == len(taken[-1].unit.data)
    assert len(taken) + backlog.skipped == len(steps)
    for before, after in itertools.pairwise(taken):
        assert after.number > before.number
        assert after.unit.keyframe or after.number == before.number + 1
        assert after.after_gap == (after.number > before.number + 1)
