import itertools

from hypothesis import given
from hypothesis import strategies as st

from sim.wire.streaming import outbox as module
from sim.wire.streaming.outbox import Outbox
from sim.wire.unit_faults import OutgoingUnit


def unit(number, *, keyframe=False, send_ns=0, size=1, taken_ns=0):
    return OutgoingUnit(number, 0, 0, taken_ns, send_ns, bytes(size), keyframe, number, 0.0, False)


def opened():
    box = Outbox()
    box.open()
    return box


def take(box, now_ns=0):
    return box.take(lambda: now_ns, 0.0)


def test_shut_it_keeps_nothing():
    box = Outbox()
    box.put(unit(0, keyframe=True))
    assert len(box) == 0
    box.open()
    box.put(unit(1, keyframe=True))
    box.shut()
    assert take(box) is None


def test_what_comes_first_is_a_keyframe():
    box = opened()
    for number in range(4):
        box.put(unit(number, keyframe=number == 2))
    assert [take(box).number, take(box).number] == [2, 3]
    assert box.dropped == 2


def test_nothing_leaves_before_its_time():
    box = opened()
    box.put(unit(0, keyframe=True, send_ns=10))
    assert take(box, 9) is None
    assert take(box, 10).number == 0


def test_a_receiver_that_is_too_slow_misses_pictures_instead_of_seeing_old_ones():
    box = opened()
    step_ns = 100_000_000
    for number in range(40):
        t_ns = number * step_ns
        box.put(unit(number, keyframe=number % 5 == 0, send_ns=t_ns, taken_ns=t_ns))
    oldest = take(box, 40 * step_ns)
    assert oldest.keyframe
    assert 20 <= oldest.number <= 25
    assert len(box) + 1 == 40 - oldest.number


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 9)), max_size=80))
def test_it_stays_bounded_and_what_leaves_can_be_decoded(puts):
    limits = module.MAX_UNITS, module.MAX_BYTES
    module.MAX_UNITS, module.MAX_BYTES = 6, 40
    try:
        box = opened()
        left = []
        for number, (keyframe, size) in enumerate(puts):
            box.put(unit(number, keyframe=keyframe, size=size))
            assert len(box) <= 6
            if number % 3 == 0 and (taken := take(box)) is not None:
                left.append(taken)
        while (taken := take(box)) is not None:
            left.append(taken)
    finally:
        module.MAX_UNITS, module.MAX_BYTES = limits
    assert len(left) + box.dropped == len(puts)
    assert all(b.keyframe or b.number == a.number + 1 for a, b in itertools.pairwise(left))
    assert not left or left[0].keyframe
