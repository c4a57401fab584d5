"""Voices that are heard: the first six, a pause keeps a place, silence does not."""

from devices.hub.media.floor import HOLD_NS, PLACES, Floor

LOUD, QUIET = 20, 90


def test_each_who_speaks_has_a_place_of_their_own_and_keeps_it():
    floor = Floor()
    assert [floor.take(index, level_db=LOUD, now_ns=0) for index in (7, 8, 7)] == [0, 1, 0]
    assert floor.take(7, level_db=QUIET, now_ns=HOLD_NS) == 0, "a pause between words"
    assert floor.take(7, level_db=QUIET, now_ns=HOLD_NS + 1) is None, "silence"
    assert floor.take(7, level_db=LOUD, now_ns=10 * HOLD_NS) == 0, "the same place as before"
    assert floor.owners()[:3] == (7, 8, None)
    assert floor.speaking(10 * HOLD_NS) == {7}


def test_of_many_the_first_are_heard_and_a_place_becomes_free_by_silence():
    floor = Floor()
    for index in range(PLACES):
        assert floor.take(index, level_db=LOUD, now_ns=0) == index
    assert floor.take(99, level_db=LOUD, now_ns=1) is None
    for index in range(1, PLACES):
        floor.take(index, level_db=LOUD, now_ns=HOLD_NS)
    assert floor.take(99, level_db=LOUD, now_ns=HOLD_NS + 1) == 0
    assert 0 not in floor.owners()


def test_who_is_silent_gets_no_place_and_who_is_muted_loses_it():
    floor = Floor()
    assert floor.take(1, level_db=QUIET, now_ns=0) is None
    floor.take(1, level_db=LOUD, now_ns=0)
    floor.drop(1)
    assert floor.speaking(0) == frozenset()
    assert set(floor.owners()) == {None}
