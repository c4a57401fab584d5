import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.streams import BoundedQueue, ByteQuota, Slot, StreamClosedError, StreamFullError

PUT_OR_TAKE = st.lists(st.booleans(), max_size=60)


@given(PUT_OR_TAKE)
def test_slot_gives_the_latest_value_and_counts_every_other_one_as_dropped(puts):
    slot = Slot()
    count, taken, last_untaken = 0, 0, None
    for put in puts:
        if put:
            slot.put(count)
            last_untaken = count
            count += 1
        else:
            assert slot.take() == last_untaken
            taken += last_untaken is not None
            last_untaken = None
    assert slot.dropped + taken + (last_untaken is not None) == count


def test_slot_wakes_a_waiting_reader_when_closed_and_keeps_its_last_value():
    slot = Slot()
    seen = []
    reader = threading.Thread(target=lambda: seen.append(slot.take(timeout_s=None)))
    reader.start()
    slot.close()
    reader.join(timeout=120)
    assert seen == [None]
    other = Slot()
    other.put("last")
    other.close()
    assert other.take(timeout_s=None) == "last"
    assert other.closed
    with pytest.raises(StreamClosedError, match="closed"):
        other.put("too late")


@given(PUT_OR_TAKE, st.integers(1, 5))
def test_queue_is_first_in_first_out_and_full_is_an_error(puts, capacity):
    queue, model, count = BoundedQueue(capacity, name="commands"), [], 0
    for put in puts:
        if put and len(model) == capacity:
            with pytest.raises(StreamFullError, match=f"commands: full with {capacity}"):
                queue.put(count)
        elif put:
            queue.put(count)
            model.append(count)
            count += 1
        else:
            assert queue.take() == (model.pop(0) if model else None)
        assert len(queue) == len(model) <= capacity


def test_queue_passes_everything_between_threads_in_order():
    queue = BoundedQueue(2)

    def send():
        for value in range(200):
            queue.put(value, timeout_s=None)
        queue.close()

    sender = threading.Thread(target=send)
    sender.start()
    received = []
    while (value := queue.take(timeout_s=None)) is not None:
        received.append(value)
    sender.join(timeout=120)
    assert received == list(range(200))
    with pytest.raises(StreamClosedError):
        queue.put(1)


def test_queue_without_room_for_anything_is_refused():
    with pytest.raises(ValueError, match="capacity 0, wanted at least 1"):
        BoundedQueue(0)


@given(st.integers(0, 1000), st.lists(st.tuples(st.integers(0, 300), st.integers(0, 300))))
def test_quota_never_goes_over_its_limit_or_into_the_reserve(limit, requests):
    quota = ByteQuota(limit)
    for size, reserve in requests:
        before = quota.used_bytes
        if quota.spend(size, reserve_bytes=reserve):
            assert quota.used_bytes == before + size
            assert limit - quota.used_bytes >= reserve
        else:
            assert quota.used_bytes == before
            assert before + size + reserve > limit


def test_negative_quota_is_refused():
    with pytest.raises(ValueError, match="limit -1 bytes"):
        ByteQuota(-1)
