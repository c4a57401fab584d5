"""Queue of units to send on one connection: bounded, in order, never before their time."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from sim.wire.unit_faults import OutgoingUnit

MAX_UNITS = 600
"""Units that wait at most: the longest delay and jitter together, 7 s, at 60 pictures a second and
some more. When they are too many, all are dropped and the next keyframe goes on, as cameras do."""

MAX_BYTES = 128 << 20
"""Bytes that wait at most: 7 s at 150 Mbit a second."""

OVERDUE_NS = 2_000_000_000
"""How late the oldest unit may be, nanoseconds, before all are dropped: a receiver that takes less
than it is sent would else see a picture that is ever older. Live encoders drop after one to three
seconds; ours is the longest distance of keyframes that is usual, so that a group fits."""


class Outbox:
    """One writer, one reader. Shut at first: nothing is kept for nobody."""

    def __init__(self) -> None:
        self._units: deque[OutgoingUnit] = deque()
        self._bytes = 0
        self._changed = threading.Condition()
        self._wants_keyframe = True
        self._is_open = False
        self.dropped = 0
        """Units that nobody took in time, or that nothing before made decodable."""

    def __len__(self) -> int:
        return len(self._units)

    @property
    def is_open(self) -> bool:
        """Whether it takes what comes."""
        return self._is_open

    def put(self, unit: OutgoingUnit) -> None:
        """Append; never blocks."""
        with self._changed:
            if not self._is_open:
                return
            if self._is_full(unit):
                self._empty()
            if self._wants_keyframe and not unit.keyframe:
                self.dropped += 1
                return
            self._wants_keyframe = False
            self._units.append(unit)
            self._bytes += len(unit.data)
            self._changed.notify_all()

    def take(self, now: Callable[[], int], timeout_s: float) -> OutgoingUnit | None:
        """The oldest unit if it is due by now or becomes so; None after a wait.

        Args:
            now: nanoseconds from the stream's beginning.
            timeout_s: longest wait; it may be shorter.
        """
        with self._changed:
            unit = self._due(now())
            if unit is None:
                wait_s = timeout_s
                if self._units:
                    wait_s = min(timeout_s, 1e-9 * (self._units[0].send_ns - now()))
                self._changed.wait(max(0.0, wait_s))
                unit = self._due(now())
            return unit

    def _is_full(self, unit: OutgoingUnit) -> bool:
        if not self._units:
            return False
        return (
            len(self._units) >= MAX_UNITS
            or self._bytes + len(unit.data) > MAX_BYTES
            or unit.taken_ns - self._units[0].send_ns > OVERDUE_NS
        )

    def _due(self, now_ns: int) -> OutgoingUnit | None:
        if not self._units or self._units[0].send_ns > now_ns:
            return None
        unit = self._units.popleft()
        self._bytes -= len(unit.data)
        return unit

    def open(self) -> None:
        """Drop what waits, and take what comes from the next keyframe on."""
        with self._changed:
            self._empty()
            self._is_open = True

    def shut(self) -> None:
        """Drop what waits, and all that comes."""
        with self._changed:
            self._empty()
            self._is_open = False

    def _empty(self) -> None:
        self.dropped += len(self._units)
        self._units.clear()
        self._bytes = 0
        self._wants_keyframe = True
