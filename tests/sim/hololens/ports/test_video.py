"""When a simulated headset's pictures are ordered, and which are left out."""

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from sim.hololens.ports.video import AHEAD, REMEMBERED, Leads, next_due_ns

PERIOD_NS = 33_333_333


@given(st.integers(0, 10**9), st.integers(10_000_000, 40_000_000), st.integers(-(10**9), 3 * 10**9))
def test_late_pictures_are_left_out_and_the_rest_keep_the_beat(before_ns, period_ns, late_ns):
    due_ns = next_due_ns(before_ns, period_ns, ready_ns=before_ns + late_ns)
    assert (due_ns - before_ns) % period_ns == 0
    assert due_ns >= before_ns + max(period_ns, late_ns)
    assert due_ns < before_ns + max(period_ns, late_ns) + period_ns


def late_ns_of_pictures(drawing_ns, count):
    """By how much each of so many pictures is sent late; each takes the next of these to draw."""
    leads, ordered, late_ns = Leads((AHEAD - 1) * PERIOD_NS), deque(), []
    now_ns = due_ns = drawn_ns = asked = 0
    for _ in range(count):
        while len(ordered) < AHEAD:
            due_ns = next_due_ns(due_ns, PERIOD_NS, ready_ns=now_ns + leads.lead_ns)
            took_ns = drawing_ns[asked % len(drawing_ns)]
            drawn_ns = max(drawn_ns, now_ns) + took_ns
            asked += 1
            ordered.append((took_ns, due_ns, drawn_ns))
        took_ns, shown_ns, ready_ns = ordered.popleft()
        now_ns = max(now_ns, ready_ns)
        leads.add(took_ns)
        late_ns.append(max(0, now_ns - shown_ns))
        now_ns = max(now_ns, shown_ns)
    return late_ns, due_ns


@given(st.integers(1, 300))
def test_however_slow_drawing_is_no_picture_is_late_once_that_is_known(drawing_ms):
    late_ns, _ = late_ns_of_pictures([drawing_ms * 1_000_000], 100)
    assert not any(late_ns[REMEMBERED:])


def test_where_drawing_is_slow_by_turns_few_pictures_are_late():
    slow = [60_000_000, 60_000_000, 150_000_000]
    late_ns, _ = late_ns_of_pictures(slow, 300)
    assert sum(late > 0 for late in late_ns[REMEMBERED:]) <= 15


def test_where_drawing_is_quick_no_picture_is_left_out():
    late_ns, end_ns = late_ns_of_pictures([20_000_000], 100)
    assert not any(late_ns)
    assert end_ns <= (100 + 2 * AHEAD) * PERIOD_NS


def test_one_slow_picture_is_forgotten():
    drawing_ns = [20_000_000] * 50 + [400_000_000] + [20_000_000] * 249
    late_ns, end_ns = late_ns_of_pictures(drawing_ns, 300)
    assert sum(late > 0 for late in late_ns) <= AHEAD
    assert end_ns <= (300 + 4 * REMEMBERED) * PERIOD_NS
