"""All that one member publishes: newest values, logs with a snapshot for who comes late, a beat."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from devices.transport.keys import Member, check_name
from devices.transport.transport import Transport, check_length
from devices.transport.wire import (
    MAX_CHANNELS,
    QUESTION,
    Beat,
    Entries,
    Entry,
    MessageBytesError,
    pack_beat,
    pack_entries,
    pack_entry,
    pack_value,
    read_header,
)

BEAT_NS = 500_000_000
"""Time between two beats: whatever was lost is noticed after that, half a second."""

MAX_ENTRIES = 2_000
"""Entries of a log that are kept for who has missed some; the others get all items anew."""

MAX_ENTRY_BYTES = 4 * 1024 * 1024
"""Their data together."""

MAX_ITEMS = 4_096
"""Items of a log that are there at a time: lines and surfaces, twice what a session takes."""

MAX_ITEMS_BYTES = 4 * 1024 * 1024
"""Their data together: 50,000 points of lines take 1.5 MB."""

BEAT, NOW, LOG, GET = "beat", "now", "log", "get"
"""Kinds of keys after a member's: its beat, a channel's value, a log's entry, questions."""


class LogFullError(ValueError):
    """A log has as many items as it may have; says how many."""


@dataclass(slots=True)
class _Log:
    newest: int = 0
    items: dict[str, Entry] = field(default_factory=dict[str, Entry])
    item_bytes: int = 0
    entries: deque[Entry] = field(default_factory=deque[Entry])
    entry_bytes: int = 0

    def add(self, item: str, data: bytes) -> Entry:
        old = self.items.get(item)
        grown = self.item_bytes + len(data) - (0 if old is None else len(old.data))
        if data and (grown > MAX_ITEMS_BYTES or (old is None and len(self.items) >= MAX_ITEMS)):
            raise LogFullError(
                f"log: {len(self.items)} items (at most {MAX_ITEMS}), {grown} bytes "
                f"(at most {MAX_ITEMS_BYTES}); erase some"
            )
        self.newest += 1
        entry = Entry(self.newest, item, data)
        self.items.pop(item, None)  # the newest last: items stay in the order of their numbers
        if data:
            self.items[item] = entry
        self.item_bytes = grown
        self.entries.append(entry)
        self.entry_bytes += len(data)
        while len(self.entries) > MAX_ENTRIES or self.entry_bytes > MAX_ENTRY_BYTES:
            self.entry_bytes -= len(self.entries.popleft().data)
        return entry

    def since(self, number: int, epoch: int) -> Entries:
        """Return the entries after that one; all items where some are not kept."""
        if self.newest - len(self.entries) <= number <= self.newest:
            found = tuple(entry for entry in self.entries if entry.number > number)
            return Entries(epoch, self.newest, False, found)
        return Entries(epoch, self.newest, True, tuple(self.items.values()))


class Source:
    """A member's channels. Any thread.

    Args:
        transport: the way to the others.
        member: whose they are.
        logs: names of the channels that are logs; any other holds a newest value.
        epoch: greater after each start of the same member: the time of day in nanoseconds.

    Raises:
        KeyNameError: a log's name is none.
    """

    def __init__(
        self, transport: Transport, member: Member, *, logs: Collection[str], epoch: int
    ) -> None:
        self.member = member
        self._transport, self._epoch = transport, epoch
        self._lock = threading.RLock()
        self._number = 0
        self._values: dict[str, tuple[int, bytes]] = {}
        self._logs = {check_name(name): _Log() for name in logs}
        self._beat = b""
        self._next_beat_ns = 0
        self._end = transport.serve(f"{member.base}/{GET}/*", self._answer)

    def set(self, channel: str, data: bytes) -> None:
        """Let a channel have that value, and send it.

        Raises:
            ValueError: it is too long, or there are too many channels.
        """
        check_name(channel)
        key = f"{self.member.base}/{NOW}/{channel}"
        with self._lock:
            if channel not in self._values and len(self._values) >= MAX_CHANNELS:
                raise ValueError(f"{key}: {MAX_CHANNELS} channels are there; drop one")
            message = pack_value(self._epoch, self._number + 1, data=data)
            check_length(key, message)
            self._number += 1
            self._values[channel] = (self._number, data)
            self._transport.put(key, message)

    def keep(self, channel: str, data: bytes) -> None:
        """Let a channel have that value, and send it unless the channel has it already.

        Raises:
            ValueError: as `set`.
        """
        with self._lock:
            known = self._values.get(channel)
            if known is None or known[1] != data:
                self.set(channel, data)

    def drop(self, channel: str) -> None:
        """Let a channel have no value; others learn it with the next beat."""
        with self._lock:
            if self._values.pop(channel, None) is not None:
                self._number += 1
                self._next_beat_ns = 0

    def append(self, log: str, item: str, *, data: bytes) -> None:
        """Replace an item of a log, and send that; without data the item is gone.

        Raises:
            LogFullError: there are too many items.
            ValueError: it is too long.
        """
        key = f"{self.member.base}/{LOG}/{log}"
        with self._lock:
            check_length(key, data)
            message = pack_entry(self._epoch, self._logs[log].add(item, data))
            self._transport.put(key, message)

    def beat(self, now_ns: int, about: Mapping[str, Any]) -> None:
        """Give a sign of life when it is due: twice a second, and when a channel was dropped.

        Args:
            now_ns: session time.
            about: said of the member, small.

        Raises:
            ValueError: too much is said.
        """
        with self._lock:
            if now_ns < self._next_beat_ns:
                return
            self._next_beat_ns = now_ns + BEAT_NS
            values = {name: number for name, (number, _data) in self._values.items()}
            logs = {name: log.newest for name, log in self._logs.items()}
            beat = Beat(self._epoch, now_ns, self._number, values, logs, about)
            self._beat = pack_beat(beat)
            self._transport.put(f"{self.member.base}/{BEAT}", self._beat)

    def close(self) -> None:
        """Answer nobody any more."""
        self._end()

    def _answer(self, key: str, question: bytes) -> bytes | None:
        channel = key.rpartition("/")[2]
        try:
            epoch, number = read_header(question, QUESTION)
        except MessageBytesError:
            return None
        with self._lock:
            if channel == BEAT:
                return self._beat or None
            log = self._logs.get(channel)
            if log is not None:
                known = number if epoch == self._epoch else -1
                return pack_entries(log.since(known, self._epoch))
            value = self._values.get(channel)
        return None if value is None else pack_value(self._epoch, value[0], data=value[1])
