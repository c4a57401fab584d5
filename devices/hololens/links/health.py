"""How one port is doing: counts and delays, of bounded size, from several threads."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import replace
from statistics import median

from devices.clock import Clock
from devices.hololens.values import StreamState, StreamStatus
from devices.messages import Event

KEPT = 64
"""Packets whose arrival and delay are kept: a second of the fastest stream."""

HELD_AFTER_NS = 1_000_000_000
"""Age of the last packet, nanoseconds, from which a stream that sends by itself is held."""

MAX_EVENTS = 64
"""Events kept until they are taken; the oldest go first."""


class StreamHealth:
    """Status of one port.

    Args:
        name: of the port, in events.
        clock: session time.
        is_steady: whether packets come by themselves, so that their absence means something.
    """

    def __init__(self, name: str, clock: Clock, *, is_steady: bool = True) -> None:
        self._name, self._clock, self._is_steady = name, clock, is_steady
        self._lock = threading.Lock()
        self._status = StreamStatus(StreamState.CONNECTING, "connecting")
        self._arrivals: deque[int] = deque(maxlen=KEPT)
        self._delays: deque[int] = deque(maxlen=KEPT)
        self._events: deque[Event] = deque(maxlen=MAX_EVENTS)

    def connected(self, text: str) -> None:
        """A connection came about."""
        with self._lock:
            count = self._status.connections + 1
            self._status = replace(self._status, connections=count, reason=text)
            self._arrivals.clear()
        self._event("connected", text)

    def came(self, size_bytes: int, *, delay_ns: int | None = None) -> None:
        """A packet came, so long after the headset's stamp."""
        now_ns = self._clock.now_ns()
        with self._lock:
            was = self._status.state
            self._arrivals.append(now_ns)
            if delay_ns is not None:
                self._delays.append(delay_ns)
            self._status = replace(
                self._status,
                state=StreamState.LIVE,
                reason="receiving",
                received=self._status.received + 1,
                received_bytes=self._status.received_bytes + size_bytes,
            )
        if was is not StreamState.LIVE:
            self._event("live", "data come")

    def damaged(self, text: str) -> None:
        """Something could not be read; said once in a row."""
        with self._lock:
            self._status = replace(self._status, damaged=self._status.damaged + 1)
            is_first = self._status.damaged == 1 or self._status.damaged % KEPT == 0
        if is_first:
            self._event("damaged", text)

    def waits(self, text: str) -> None:
        """The connection is gone; it is tried again."""
        with self._lock:
            is_new = self._status.state is not StreamState.WAITING or self._status.reason != text
            self._status = replace(self._status, state=StreamState.WAITING, reason=text)
            self._arrivals.clear()
        if is_new:
            self._event("waiting", text)

    def closed(self) -> None:
        """Nothing more will come."""
        with self._lock:
            self._status = replace(self._status, state=StreamState.CLOSED, reason="closed")

    def status(self, *, dropped: int = 0, damaged: int = 0) -> StreamStatus:
        """Return how it is doing, with what others have counted."""
        now_ns = self._clock.now_ns()
        with self._lock:
            status, arrivals = self._status, tuple(self._arrivals)
            delays = tuple(self._delays)
        status = replace(status, dropped=dropped, damaged=status.damaged + damaged)
        if delays:
            status = replace(status, delay_ms=median(delays) / 1e6)
        if not arrivals:
            return status
        age_ns = max(0, now_ns - arrivals[-1])
        spread_ns = now_ns - arrivals[0]
        rate_hz = len(arrivals) / max(spread_ns * 1e-9, 1e-3) if len(arrivals) > 1 else 0.0
        status = replace(status, last_age_ns=age_ns, rate_hz=rate_hz)
        if self._is_steady and age_ns > HELD_AFTER_NS and status.state is StreamState.LIVE:
            reason = f"nothing for {age_ns / 1e9:.1f} s; the last is kept"
            return replace(status, state=StreamState.HELD, reason=reason)
        return status

    def take_events(self) -> list[Event]:
        """Take what happened since the last call, oldest first."""
        taken: list[Event] = []
        while self._events:
            taken.append(self._events.popleft())
        return taken

    def _event(self, kind: str, text: str) -> None:
        event = Event(self._clock.now_ns(), "hololens", f"{self._name}-{kind}", text)
        self._events.append(event)
