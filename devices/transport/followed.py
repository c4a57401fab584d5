"""One member as others hear it: what is new, and what has been missed. No socket here."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from devices.transport.keys import Member
from devices.transport.wire import MAX_CHANNELS, Beat, Entries, Entry, total_bytes

AWAY_NS = 2_000_000_000
"""Time without a beat after which a member is away: four beats."""

ASK_AGAIN_NS = 500_000_000
"""Time after which what was not answered is asked for again."""

MAX_WAITING = 8_192
"""Entries of a log that wait to be taken, a whole log of 4,096 items and as many more; of more,
none is kept, and they are asked for when somebody takes them."""

MAX_WAITING_BYTES = 8 * 1024 * 1024
"""Their bytes together; a whole log of 4 MB may come beside 4 MB of entries."""


@dataclass(frozen=True, slots=True)
class LogNews:
    """News of a log.

    Attributes:
        is_whole: whether the entries are all that there is: any other item is gone.
        entries: in order.
    """

    is_whole: bool
    entries: tuple[Entry, ...]


@dataclass(frozen=True, slots=True, eq=False)
class News:
    """News of a member since the last look.

    Attributes:
        member: of whom.
        is_new: whether it has started (again): all that was known of it counts no more.
        is_away: whether nothing is heard of it.
        about: said of it.
        beat: its session time at its newest beat, and when that came; None before the first.
        values: newest value of each channel that has another; None where it has none any more.
        logs: entries by log.
        epoch: of its newest start.
    """

    member: Member
    is_new: bool
    is_away: bool
    about: Mapping[str, Any]
    beat: tuple[int, int] | None
    values: Mapping[str, bytes | None]
    logs: Mapping[str, LogNews]
    epoch: int = 0


@dataclass(slots=True)
class _Log:
    """Entries of a log that were received, and handed out; -1 for none."""

    received: int = -1
    handed: int = -1
    wanted: int = 0
    is_whole: bool = False
    waiting: list[Entry] = field(default_factory=list[Entry])
    waiting_bytes: int = 0

    def hear(self, entries: tuple[Entry, ...]) -> None:
        self.waiting.extend(entries)
        self.waiting_bytes += total_bytes(entries)
        if len(self.waiting) > MAX_WAITING or self.waiting_bytes > MAX_WAITING_BYTES:
            self._lose()

    def _lose(self) -> None:
        """Let whoever reads too seldom get it all later: from the source, which keeps it."""
        self.wanted = max(self.wanted, self.received)
        self.received, self.is_whole = self.handed, False
        self.waiting.clear()
        self.waiting_bytes = 0

    def take(self) -> LogNews | None:
        if not self.waiting and not self.is_whole:
            return None
        news = LogNews(self.is_whole, tuple(self.waiting))
        self.handed, self.is_whole = self.received, False
        self.waiting.clear()
        self.waiting_bytes = 0
        return news


class Followed:
    """One member. The caller keeps others off.

    Args:
        member: of whom.
        logs: names of its logs.
        now_ns: session time.
    """

    def __init__(self, member: Member, logs: Collection[str], *, now_ns: int) -> None:
        self.member = member
        self._names = tuple(logs)
        self._epoch = -1
        self._beat_ns = now_ns
        self._stamps: tuple[int, int] | None = None
        self._about: Mapping[str, Any] = {}
        self._numbers: dict[str, int] = {}
        self._wanted: dict[str, int] = {}
        self._fresh: dict[str, bytes | None] = {}
        self._logs = {name: _Log() for name in self._names}
        self._asked: dict[str, int] = {}
        self._is_new = self._was_away = False

    @property
    def epoch(self) -> int:
        """Of the source as it is known; -1 before anything was heard."""
        return self._epoch

    def is_away(self, now_ns: int) -> bool:
        """Return whether nothing has been heard for too long."""
        return now_ns - self._beat_ns >= AWAY_NS

    def hear_beat(self, beat: Beat, now_ns: int) -> bool:
        """Take a sign of life; return whether it is one of the newest start."""
        if not self._is_current(beat.epoch, now_ns):
            return False
        self._beat_ns, self._stamps = now_ns, (beat.t_ns, now_ns)
        self._about = beat.about
        self._wanted = dict(beat.values)
        for name, log in self._logs.items():
            log.wanted = max(log.wanted, beat.logs.get(name, 0))
        for name, number in list(self._numbers.items()):
            if name not in beat.values and number <= beat.newest:
                del self._numbers[name]
                self._fresh[name] = None
        return True

    def hear_value(
        self, channel: str, data: bytes, *, epoch: int, number: int, now_ns: int
    ) -> bool:
        """Take a channel's value if it is newer; return whether it may be one."""
        if not self._is_current(epoch, now_ns):
            return False
        if channel not in self._numbers and len(self._numbers) >= MAX_CHANNELS:
            return False
        if number > self._numbers.get(channel, 0):
            self._numbers[channel] = number
            self._fresh[channel] = data
        self._asked.pop(channel, None)
        return True

    def hear_entry(self, name: str, entry: Entry, *, epoch: int, now_ns: int) -> bool:
        """Take an entry if it is the next one; what comes after a gap is asked for."""
        if not self._is_current(epoch, now_ns) or name not in self._logs:
            return False
        log = self._logs[name]
        log.wanted = max(log.wanted, entry.number)
        if log.received >= 0 and entry.number == log.received + 1:
            log.received = entry.number
            log.hear((entry,))
        return True

    def hear_entries(self, name: str, entries: Entries, *, now_ns: int) -> bool:
        """Take an answer: what is new in it, or all items."""
        if not self._is_current(entries.epoch, now_ns) or name not in self._logs:
            return False
        log = self._logs[name]
        self._asked.pop(name, None)
        if entries.newest < log.received:
            return True  # an answer that entries have overtaken
        if entries.is_whole:
            log.waiting.clear()
            log.waiting_bytes = 0
            log.is_whole = True
            log.received = entries.newest
            log.hear(entries.entries)
            return True
        new = tuple(entry for entry in entries.entries if entry.number > log.received)
        if log.received < 0 or (new and new[0].number != log.received + 1):
            return False
        if new:
            log.received = entries.newest
            log.hear(new)
        return True

    def due(self, now_ns: int) -> list[tuple[str, int]]:
        """Return channels whose newest is to be asked for, with the number that is known."""
        if self._epoch < 0 or self.is_away(now_ns):
            return []
        behind = [
            (name, self._numbers.get(name, 0))
            for name, number in self._wanted.items()
            if number > self._numbers.get(name, 0)
        ]
        behind += [
            (name, max(0, log.received))
            for name, log in self._logs.items()
            if log.received < 0 or log.wanted > log.received
        ]
        due = [
            (name, number)
            for name, number in behind
            if now_ns - self._asked.get(name, -ASK_AGAIN_NS) >= ASK_AGAIN_NS
        ]
        self._asked |= dict.fromkeys((name for name, _number in due), now_ns)
        return due

    def knows_log(self, name: str) -> bool:
        """Return whether a channel is a log of which something is known."""
        return name in self._logs and self._logs[name].received >= 0

    def take(self, now_ns: int) -> News | None:
        """Return what is new; None where nothing is."""
        if self._epoch < 0:
            return None
        is_away = self.is_away(now_ns)
        logs = {name: news for name, log in self._logs.items() if (news := log.take())}
        is_same = is_away == self._was_away and not self._is_new
        if is_same and not self._fresh and not logs:
            return None
        news = News(
            self.member,
            self._is_new,
            is_away,
            self._about,
            self._stamps,
            self._fresh,
            logs,
            self._epoch,
        )
        self._fresh = {}
        self._is_new, self._was_away = False, is_away
        return news

    def _is_current(self, epoch: int, now_ns: int) -> bool:
        """Return whether an epoch is the newest; begin anew where it is newer than any known.

        A machine whose clock was set back is believed once its former start is not heard any more.
        """
        if epoch == self._epoch:
            return True
        if epoch < self._epoch and not self.is_away(now_ns):
            return False
        self._epoch, self._beat_ns, self._is_new = epoch, now_ns, True
        self._numbers, self._wanted, self._fresh, self._asked = {}, {}, {}, {}
        self._logs = {name: _Log() for name in self._names}
        return True
