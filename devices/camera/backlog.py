"""Encoded pictures between the thread that reads them and the one that decodes them.

Where decoding is late, what was read waits here and not in the connection: its time of arrival is
the true one, and what a newer keyframe makes useless is never decoded.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

from devices.camera.units import Unit

MAX_BYTES = 1 << 26
"""Encoded bytes that wait at most, 64 MiB: 10 s of the fastest stream known, 50 Mbit/s. A camera
that sends a keyframe more often never comes near."""


@dataclass(frozen=True, slots=True, eq=False)
class Arrived:
    """A unit and when it came.

    Attributes:
        unit: one encoded picture.
        number: counts the receiver's units from 0.
        t_ns: when its last byte arrived, session time.
        after_gap: whether units of its track before it were left out; it is a keyframe then.
    """

    unit: Unit
    number: int
    t_ns: int
    after_gap: bool = False


class Backlog:
    """Units that wait to be decoded; putting never blocks. One producer, one consumer.

    A keyframe replaces everything that waits before it, for only the newest picture is of use. Of
    several tracks nothing is replaced: which of their pictures belong together is known by their
    order alone.

    Args:
        tracks: picture tracks of the source.
        max_bytes: more is given up, up to the next keyframe.
    """

    def __init__(self, tracks: int, *, max_bytes: int = MAX_BYTES) -> None:
        self._tracks = tracks
        self._max_bytes = max_bytes
        self._waiting: deque[Arrived] = deque()
        self._bytes = 0
        self._skipped = 0
        self._broken: set[int] = set()
        self._closed = False
        self._changed = threading.Condition()

    @property
    def skipped(self) -> int:
        """Units that are never decoded, since a newer picture was there already."""
        return self._skipped

    def put(self, arrived: Arrived) -> None:
        """Append a unit; after `close` it is dropped."""
        unit = arrived.unit
        with self._changed:
            if self._closed:
                return
            is_replaced = unit.keyframe and self._tracks == 1
            is_full = self._bytes + len(unit.data) > self._max_bytes
            if self._waiting and (is_replaced or is_full):
                self._give_up()
            self._append(arrived)
            self._changed.notify_all()

    def take(self) -> Arrived | None:
        """Remove and return the oldest unit, waiting for one; None once closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._waiting) or self._closed)
            if not self._waiting:
                return None
            arrived = self._waiting.popleft()
            self._bytes -= len(arrived.unit.data)
            return arrived

    def close(self, *, finish: bool) -> None:
        """No more units.

        Args:
            finish: whether what waits can still be taken.
        """
        with self._changed:
            self._closed = True
            if not finish:
                self._waiting.clear()
            self._changed.notify_all()

    def _append(self, arrived: Arrived) -> None:
        unit = arrived.unit
        if unit.track in self._broken:
            # The first track leads, so that its pictures are paired with the right ones again.
            if not unit.keyframe or (unit.track and 0 in self._broken):
                self._skipped += 1
                return
            self._broken.discard(unit.track)
            arrived = Arrived(unit, arrived.number, arrived.t_ns, after_gap=True)
        self._waiting.append(arrived)
        self._bytes += len(unit.data)

    def _give_up(self) -> None:
        """Leave out all that waits, and all up to the next keyframe of each track."""
        self._skipped += len(self._waiting)
        self._waiting.clear()
        self._bytes = 0
        self._broken = set(range(self._tracks))
