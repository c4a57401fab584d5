"""A source: its answers, its limits."""

import pytest

from devices.transport import source as module
from devices.transport.keys import room
from devices.transport.local import Exchange, LocalTransport
from devices.transport.source import BEAT_NS, LogFullError, Source
from devices.transport.wire import pack_question, read_beat, read_entries, read_value

BASE = "gn/lab/room/lab"


@pytest.fixture
def ways():
    exchange = Exchange()
    taken = []
    far = LocalTransport(exchange)
    far.subscribe("gn/**", lambda key, data: taken.append((key, data)))
    return Source(LocalTransport(exchange), room("lab"), logs=("drawn",), epoch=5), far, taken


def asked(far, channel, *, epoch=5, number=0):
    answers = []
    far.ask(f"{BASE}/get/{channel}", pack_question(epoch, number), answered=answers.append)
    return answers[0] if answers else None


def test_a_value_is_sent_and_kept(ways):
    source, far, taken = ways
    source.set("objects", b"1")
    source.set("objects", b"2")
    assert [key for key, _data in taken] == [f"{BASE}/now/objects"] * 2
    assert read_value(asked(far, "objects")) == (5, 2, b"2")
    assert asked(far, "nothing") is None
    source.drop("objects")
    assert asked(far, "objects") is None


def test_a_value_that_is_kept_is_sent_once(ways):
    source, far, taken = ways
    for data in (b"1", b"1", b"2", b"2"):
        source.keep("people", data)
    assert len(taken) == 2
    assert read_value(asked(far, "people")) == (5, 2, b"2")
    source.drop("people")
    source.keep("people", b"2")
    assert len(taken) == 3


def test_a_log_gives_what_was_missed_or_all(ways, monkeypatch):
    source, far, _heard = ways
    monkeypatch.setattr(module, "MAX_ENTRIES", 3)
    for number in range(6):
        source.append("drawn", f"line {number % 4}", data=b"%d" % number)
    since = read_entries(asked(far, "drawn", number=4))
    assert (since.is_whole, [entry.number for entry in since.entries]) == (False, [5, 6])
    whole = read_entries(asked(far, "drawn", number=1))
    assert whole.is_whole
    assert {entry.item: entry.data for entry in whole.entries} == {
        "line 2": b"2",
        "line 3": b"3",
        "line 0": b"4",
        "line 1": b"5",
    }
    assert read_entries(asked(far, "drawn", epoch=4, number=6)).is_whole, "of another start"
    assert read_entries(asked(far, "drawn", number=7)).is_whole, "from the future"


def test_a_beat_says_what_there_is(ways):
    source, far, taken = ways
    assert asked(far, "beat") is None
    source.set("objects", b"1")
    source.append("drawn", "a", data=b"1")
    source.beat(10, {"scene": "lab"})
    source.beat(11, {"scene": "lab"})
    beats = [read_beat(data) for key, data in taken if key == f"{BASE}/beat"]
    assert len(beats) == 1
    assert (beats[0].values, beats[0].logs) == ({"objects": 1}, {"drawn": 1})
    assert read_beat(asked(far, "beat")) == beats[0]
    source.drop("objects")
    source.beat(12, {})
    assert read_beat(taken[-1][1]).values == {}, "at once: something is gone"
    source.beat(12 + BEAT_NS, {})
    assert read_beat(taken[-1][1]).t_ns == 12 + BEAT_NS


def test_everything_has_a_limit(ways, monkeypatch):
    source, _far, _heard = ways
    monkeypatch.setattr(module, "MAX_ITEMS", 2)
    source.append("drawn", "a", data=b"1")
    source.append("drawn", "b", data=b"1")
    with pytest.raises(LogFullError, match="erase some"):
        source.append("drawn", "c", data=b"1")
    source.append("drawn", "a", data=b"")
    source.append("drawn", "c", data=b"1")
    with pytest.raises(ValueError, match="at most"):
        source.set("objects", bytes(2_000_000))
    for number in range(module.MAX_CHANNELS):
        source.set(f"picture-{number}", b"")
    with pytest.raises(ValueError, match="channels"):
        source.set("one-more", b"")


def test_junk_is_not_answered(ways):
    _source, far, _heard = ways
    answers = []
    far.ask(f"{BASE}/get/drawn", b"junk", answered=answers.append)
    assert answers == []
