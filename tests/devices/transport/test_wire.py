"""Bytes of messages: round trips, and everything damaged is refused."""

import json
from random import Random

import pytest

from devices.transport.wire import (
    QUESTION,
    Beat,
    Entries,
    Entry,
    MessageBytesError,
    pack_beat,
    pack_entries,
    pack_entry,
    pack_question,
    pack_value,
    read_beat,
    read_entries,
    read_entry,
    read_header,
    read_value,
)

ENTRIES = Entries(7, 9, False, (Entry(3, "line a", b"one"), Entry(9, "ü", b"")))
BEAT = Beat(7, 10**12, 5, {"objects": 4}, {"drawn": 9}, {"scene": "lab"})


def test_round_trips():
    assert read_value(pack_value(7, 4, data=b"data")) == (7, 4, b"data")
    assert read_entry(pack_entry(7, ENTRIES.entries[0])) == (7, ENTRIES.entries[0])
    assert read_entries(pack_entries(ENTRIES)) == ENTRIES
    assert read_beat(pack_beat(BEAT)) == BEAT
    assert read_header(pack_question(7, 3), QUESTION) == (7, 3)


READERS = [
    (read_entry, pack_entry(7, ENTRIES.entries[0])),
    (read_entries, pack_entries(ENTRIES)),
    (read_beat, pack_beat(BEAT)),
]


@pytest.mark.parametrize(("read", "good"), READERS, ids=["entry", "entries", "beat"])
def test_cut_at_every_byte(read, good):
    for length in range(len(good)):
        with pytest.raises(MessageBytesError):
            read(good[:length])


@pytest.mark.parametrize("read", [read_value, read_entry, read_entries, read_beat])
def test_any_bytes_are_read_or_refused(read):
    random = Random(0)
    for _, good in READERS:
        for _ in range(2_000):
            data = bytearray(good)
            for _ in range(random.randint(1, 4)):
                data[random.randrange(len(data))] = random.randrange(256)
            try:
                read(bytes(data))
            except MessageBytesError:
                continue


def test_a_count_that_is_too_large_is_refused_before_it_is_believed():
    data = bytearray(pack_entries(ENTRIES))
    data[19:23] = b"\xff\xff\xff\xff"
    with pytest.raises(MessageBytesError, match="4294967295"):
        read_entries(bytes(data))


@pytest.mark.parametrize(
    "numbers", [(3, 3), (3, 2), (0, 1), (9, 10)], ids=["twice", "back", "none", "after the newest"]
)
def test_entries_are_in_order(numbers):
    entries = tuple(Entry(number, "a", b"") for number in numbers)
    with pytest.raises(MessageBytesError):
        read_entries(pack_entries(Entries(7, 9, False, entries)))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("v", 2),
        ("epoch", -1),
        ("epoch", 2**63),
        ("t_ns", 1.5),
        ("newest", True),
        ("values", []),
        ("values", {str(n): 1 for n in range(65)}),
        ("logs", {"drawn": None}),
        ("about", "lab"),
    ],
)
def test_a_beat_s_fields_are_checked(field, value):
    fields = json.loads(pack_beat(BEAT)) | {field: value}
    with pytest.raises(MessageBytesError):
        read_beat(json.dumps(fields).encode())


def test_too_much_is_not_sent():
    with pytest.raises(ValueError, match="say less"):
        pack_beat(Beat(1, 1, 1, about={"text": "x" * 20_000}))
    with pytest.raises(ValueError, match="log's item"):
        pack_entry(1, Entry(1, "x" * 301, b""))
