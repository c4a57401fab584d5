"""Bytes of members' messages: values, log entries, answers and beats; every length is checked."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

VERSION = 1
"""Of the layout; others are refused."""

VALUE, ENTRY, QUESTION, ENTRIES = 1, 2, 3, 4
"""Kinds of messages, the second byte."""

MAX_BEAT_BYTES = 16 * 1024
"""Length of a beat: 64 channels and what is said about a member."""

MAX_CHANNELS = 64
"""Channels of a member: its values, and a picture of each of its surfaces."""

MAX_ITEM_BYTES = 300
"""Length of the name of a log's item: of a line or surface, with a site's and a person's."""

MAX_COUNT = 2**63
"""Numbers and times are below this."""

_HEADER = struct.Struct("<BBQQ")
"""Version, kind, epoch of the source, number."""

_ENTRY = struct.Struct("<QHI")
"""Number, length of the item's name, length of its data."""

_COUNT = struct.Struct("<BI")
"""Whether these are all items that there are, and how many."""


class MessageBytesError(ValueError):
    """Bytes that are no message; says which part, and how many bytes were wanted."""


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a log: an item's new data; none where the item is gone.

    Attributes:
        number: one more than the entry before.
        item: name of that which it replaces.
        data: what it is now.
    """

    number: int
    item: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Entries:
    """Entries of a log together.

    Attributes:
        epoch: of the source.
        newest: number of the log's newest entry.
        is_whole: whether these are all items that there are, for who has missed too much.
        entries: in the order of their numbers.
    """

    epoch: int
    newest: int
    is_whole: bool
    entries: tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class Beat:
    """A sign of life of a source: what it has, so that whoever has missed something asks.

    Attributes:
        epoch: of the source, greater after each start.
        t_ns: its session time.
        newest: number of its newest value.
        values: number of each channel's value.
        logs: number of each log's newest entry.
        about: said of it, small.
    """

    epoch: int
    t_ns: int
    newest: int
    values: Mapping[str, int] = field(default_factory=dict[str, int])
    logs: Mapping[str, int] = field(default_factory=dict[str, int])
    about: Mapping[str, Any] = field(default_factory=dict[str, Any])


def pack_value(epoch: int, number: int, *, data: bytes) -> bytes:
    """Return a value as it is sent."""
    return _HEADER.pack(VERSION, VALUE, epoch, number) + data


def pack_question(epoch: int, number: int) -> bytes:
    """Return a question for all that came after a number of a source."""
    return _HEADER.pack(VERSION, QUESTION, epoch, number)


def pack_entry(epoch: int, entry: Entry) -> bytes:
    """Return an entry as it is sent by itself."""
    return _HEADER.pack(VERSION, ENTRY, epoch, entry.number) + _entry_bytes(entry)


def pack_entries(entries: Entries) -> bytes:
    """Return entries together."""
    head = _HEADER.pack(VERSION, ENTRIES, entries.epoch, entries.newest)
    count = _COUNT.pack(entries.is_whole, len(entries.entries))
    return b"".join((head, count, *(_entry_bytes(entry) for entry in entries.entries)))


def pack_beat(beat: Beat) -> bytes:
    """Return a beat as it is sent.

    Raises:
        ValueError: it is too long.
    """
    fields = {
        "v": VERSION,
        "epoch": beat.epoch,
        "t_ns": beat.t_ns,
        "newest": beat.newest,
        "values": dict(beat.values),
        "logs": dict(beat.logs),
        "about": dict(beat.about),
    }
    data = json.dumps(fields, separators=(",", ":")).encode()
    if len(data) > MAX_BEAT_BYTES:
        raise ValueError(f"beat: {len(data)} bytes, at most {MAX_BEAT_BYTES}; say less about it")
    return data


def read_header(data: bytes, kind: int) -> tuple[int, int]:
    """Return epoch and number of a message of that kind.

    Raises:
        MessageBytesError: it is none.
    """
    if len(data) < _HEADER.size:
        raise MessageBytesError(f"message: {len(data)} bytes, wanted at least {_HEADER.size}")
    version, found, epoch, number = _HEADER.unpack_from(data)
    if (version, found) != (VERSION, kind):
        raise MessageBytesError(f"message: version {version}, kind {found}; wanted 1, {kind}")
    if epoch >= MAX_COUNT or number >= MAX_COUNT:
        raise MessageBytesError(f"message: epoch {epoch}, number {number}; wanted below 2⁶³")
    return epoch, number


def read_value(data: bytes) -> tuple[int, int, bytes]:
    """Return epoch, number and bytes of a value.

    Raises:
        MessageBytesError: it is none.
    """
    epoch, number = read_header(data, VALUE)
    return epoch, number, data[_HEADER.size :]


def read_entry(data: bytes) -> tuple[int, Entry]:
    """Return epoch and entry of a message.

    Raises:
        MessageBytesError: it is none.
    """
    epoch, number = read_header(data, ENTRY)
    entry, end = _read_entry(data, _HEADER.size)
    if end != len(data) or entry.number != number:
        raise MessageBytesError(f"entry {number}: {len(data)} bytes, wanted {end}")
    return epoch, entry


def read_entries(data: bytes) -> Entries:
    """Return entries that came together.

    Raises:
        MessageBytesError: they are none, or out of order.
    """
    epoch, newest = read_header(data, ENTRIES)
    if len(data) < _HEADER.size + _COUNT.size:
        raise MessageBytesError(f"entries: {len(data)} bytes, the count is missing")
    is_whole, count = _COUNT.unpack_from(data, _HEADER.size)
    at = _HEADER.size + _COUNT.size
    if count > (len(data) - at) // _ENTRY.size:
        raise MessageBytesError(f"entries: {count} of them in {len(data)} bytes")
    found: list[Entry] = []
    before = 0
    for _ in range(count):
        entry, at = _read_entry(data, at)
        if not before < entry.number <= newest:
            raise MessageBytesError(f"entries: {entry.number} after {before}, newest {newest}")
        before = entry.number
        found.append(entry)
    if at != len(data):
        raise MessageBytesError(f"entries: {len(data)} bytes, wanted {at}")
    return Entries(epoch, newest, bool(is_whole), tuple(found))


def read_beat(data: bytes) -> Beat:
    """Return a beat.

    Raises:
        MessageBytesError: it is none.
    """
    if len(data) > MAX_BEAT_BYTES:
        raise MessageBytesError(f"beat: {len(data)} bytes, at most {MAX_BEAT_BYTES}")
    try:
        fields: Any = json.loads(data)
        if fields["v"] != VERSION:
            raise MessageBytesError(f"beat: version {fields['v']!r}, wanted {VERSION}")
        return Beat(
            _count(fields["epoch"]),
            _count(fields["t_ns"]),
            _count(fields["newest"]),
            _counts(fields["values"]),
            _counts(fields["logs"]),
            _about(fields["about"]),
        )
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise MessageBytesError(f"beat: {type(error).__name__}: {error}") from None


def _entry_bytes(entry: Entry) -> bytes:
    name = entry.item.encode()
    if not 0 < len(name) <= MAX_ITEM_BYTES:
        raise ValueError(f"log's item {entry.item[:40]!r}: wanted 1 to {MAX_ITEM_BYTES} bytes")
    return _ENTRY.pack(entry.number, len(name), len(entry.data)) + name + entry.data


def _read_entry(data: bytes, at: int) -> tuple[Entry, int]:
    if len(data) - at < _ENTRY.size:
        raise MessageBytesError(f"entry: {len(data) - at} bytes, wanted at least {_ENTRY.size}")
    number, name_length, length = _ENTRY.unpack_from(data, at)
    at += _ENTRY.size
    if not 0 < name_length <= MAX_ITEM_BYTES or name_length + length > len(data) - at:
        raise MessageBytesError(
            f"entry {number}: name of {name_length} and data of {length} bytes, "
            f"{len(data) - at} are left"
        )
    try:
        item = data[at : at + name_length].decode()
    except UnicodeDecodeError as error:
        raise MessageBytesError(f"entry {number}: name: {error.reason}") from None
    at += name_length
    return Entry(number, item, data[at : at + length]), at + length


def _count(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < MAX_COUNT:
        raise MessageBytesError("wanted a whole number of 0 or more")
    return value


def _counts(value: object) -> dict[str, int]:
    if not isinstance(value, dict):
        raise MessageBytesError("wanted channels and numbers")
    given = cast(dict[str, object], value)
    if len(given) > MAX_CHANNELS:
        raise MessageBytesError(f"{len(given)} channels, at most {MAX_CHANNELS}")
    return {name: _count(number) for name, number in given.items()}


def _about(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise MessageBytesError("about: wanted an object")
    return cast(dict[str, Any], value)


def total_bytes(entries: Sequence[Entry]) -> int:
    """Return about how many bytes entries take."""
    return sum(_ENTRY.size + len(entry.item) + len(entry.data) for entry in entries)
