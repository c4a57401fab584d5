"""All that is heard of other members, made whole again whenever something was missed."""

from __future__ import annotations

import threading
from collections.abc import Collection, Mapping

from devices.clock import Clock
from devices.transport.followed import ASK_AGAIN_NS, Followed, News
from devices.transport.keys import Member, read_key
from devices.transport.source import BEAT, GET, LOG, NOW
from devices.transport.transport import Transport
from devices.transport.wire import (
    ENTRIES,
    MAX_BEAT_BYTES,
    MessageBytesError,
    pack_question,
    read_beat,
    read_entries,
    read_entry,
    read_value,
)

MAX_MEMBERS = 64
"""Members that a follower knows unless told otherwise, chosen: sites in one room."""

FORGET_NS = 60_000_000_000
"""Time without a beat after which nothing of a member is kept any more: a minute."""

QUESTION_OF_NONE = 0
"""Epoch in a question of who knows none."""


class Follower:
    """Members of one role. Messages are heard on any thread; `take` is for one of them.

    Args:
        transport: the way to them.
        members: who they are, or a pattern of them.
        limits: longest value in bytes by channel (or its name before a dash); of any other channel
            nothing is kept.
        logs: channels that are logs.
        clock: session time.
        max_members: of more, nothing is kept.
    """

    def __init__(
        self,
        transport: Transport,
        members: Member,
        *,
        limits: Mapping[str, int],
        logs: Collection[str],
        clock: Clock,
        max_members: int = MAX_MEMBERS,
    ) -> None:
        self._max_members = max_members
        self._transport, self._members, self._clock = transport, members, clock
        self._limits, self._logs = dict(limits), tuple(logs)
        self._lock = threading.Lock()
        self._followed: dict[Member, Followed] = {}
        self._asked_ns = -ASK_AGAIN_NS
        self.refused = 0
        """Messages so far that could not be read, or were more than is kept."""
        base = members.base
        kinds = (BEAT, *((f"{NOW}/*",) if limits else ()), *((f"{LOG}/*",) if logs else ()))
        self._ends = [transport.subscribe(f"{base}/{kind}", self._hear) for kind in kinds]

    def take(self) -> tuple[News, ...]:
        """Return what is new since the last call, and ask for what was missed."""
        now_ns = self._clock.now_ns()
        found: list[News] = []
        questions: list[tuple[Followed, str, int]] = []
        with self._lock:
            for member, followed in list(self._followed.items()):
                news = followed.take(now_ns)
                if news is not None:
                    found.append(news)
                if followed.is_away(now_ns - FORGET_NS):
                    del self._followed[member]
                questions += [(followed, *due) for due in followed.due(now_ns)]
            asks_first = not self._followed and now_ns - self._asked_ns >= ASK_AGAIN_NS
        for followed, channel, number in questions:
            self._ask(followed, channel, number=number)
        if asks_first and not self._members.is_pattern:
            self._asked_ns = now_ns
            self._ask_for_beat()
        return tuple(found)

    def close(self) -> None:
        """Hear nothing any more."""
        for end in self._ends:
            end()

    def _ask(self, followed: Followed, channel: str, *, number: int) -> None:
        knows = channel not in self._logs or followed.knows_log(channel)
        epoch = followed.epoch if knows else QUESTION_OF_NONE
        self._transport.ask(
            f"{followed.member.base}/{GET}/{channel}",
            pack_question(epoch, number),
            answered=lambda data: self._take_answer(followed.member, channel, data=data),
        )

    def _ask_for_beat(self) -> None:
        member = self._members
        self._transport.ask(
            f"{member.base}/{GET}/{BEAT}",
            pack_question(QUESTION_OF_NONE, 0),
            answered=lambda data: self._hear(f"{member.base}/{BEAT}", data),
        )

    def _hear(self, key: str, data: bytes) -> None:
        found = read_key(key)
        if found is None or not self._members.holds(found[0]):
            self.refused += 1
            return
        member, kind, channel = found
        with self._lock:
            try:
                is_taken = self._read(member, kind, channel=channel, data=data)
            except MessageBytesError:
                is_taken = False
        self.refused += not is_taken

    def _read(self, member: Member, kind: str, *, channel: str, data: bytes) -> bool:
        followed, now_ns = self._find(member), self._clock.now_ns()
        if followed is None:
            return False
        if kind == BEAT and len(data) <= MAX_BEAT_BYTES:
            return followed.hear_beat(read_beat(data), now_ns)
        if kind == NOW:
            return self._read_value(followed, channel, data=data, now_ns=now_ns)
        if kind == LOG and channel in self._logs:
            epoch, entry = read_entry(data)
            return followed.hear_entry(channel, entry, epoch=epoch, now_ns=now_ns)
        return False

    def _read_value(self, followed: Followed, channel: str, *, data: bytes, now_ns: int) -> bool:
        epoch, number, value = read_value(data)
        if len(value) > self._limits.get(channel.partition("-")[0], -1):
            return False
        return followed.hear_value(channel, value, epoch=epoch, number=number, now_ns=now_ns)

    def _take_answer(self, member: Member, channel: str, *, data: bytes) -> None:
        with self._lock:
            followed, now_ns = self._find(member), self._clock.now_ns()
            if followed is None:
                return
            try:
                if data[1:2] == bytes([ENTRIES]):
                    is_taken = followed.hear_entries(channel, read_entries(data), now_ns=now_ns)
                else:
                    is_taken = self._read_value(followed, channel, data=data, now_ns=now_ns)
            except MessageBytesError:
                is_taken = False
        self.refused += not is_taken

    def _find(self, member: Member) -> Followed | None:
        followed = self._followed.get(member)
        if followed is None and len(self._followed) < self._max_members:
            followed = Followed(member, self._logs, now_ns=self._clock.now_ns())
            self._followed[member] = followed
        return followed
