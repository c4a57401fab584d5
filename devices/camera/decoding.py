"""Decoding on a thread of its own, beside the one that reads: a late decoder delays no reading.

Where decoding is late, what was read waits here and not in the connection: its time of arrival is
the true one, and what a newer keyframe makes useless is never decoded.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from devices.camera.received import Received
from devices.camera.stream_decoder import Decoded, StreamDecoder
from devices.camera.units import IDLE_S, SourceError, Unit
from devices.clock import Clock
from scenes.workers.task import Task

CLOSE_S = 5.0
"""Seconds that `close` waits for the thread; a picture of 5760 × 2880 takes it 0.1 s."""

MAX_HELD_BACK = 64
"""Units that a decoder may take before it gives the picture of the first: 16 in H.264 and HEVC, on
up to four tracks."""

MAX_BYTES = 1 << 26
"""Encoded bytes that wait at most, 64 MiB: 10 s of the fastest stream known, 50 Mbit/s. A camera
that sends a keyframe more often never comes near."""


class Decoding:
    """Decodes the units of one source; starts at once.

    Args:
        tracks: picture tracks of the source.
        clock: session time.
        name: of the thread.
        hand_out: takes every picture of the camera, on this thread.
    """

    def __init__(
        self, tracks: int, *, clock: Clock, name: str, hand_out: Callable[[Received], None]
    ) -> None:
        self._backlog = Backlog(tracks)
        self._decoder = StreamDecoder(tracks)
        self._clock = clock
        self._hand_out = hand_out
        self._taken: deque[tuple[int, int, int | None]] = deque(maxlen=MAX_HELD_BACK)
        self._error: SourceError | None = None
        self._task = Task(name, self._run)
        self._task.start()

    @property
    def skipped(self) -> int:
        """Units that were not decoded, since a newer picture was there already."""
        return self._backlog.skipped

    @property
    def damaged(self) -> int:
        """Units that gave no picture because they are damaged."""
        return self._decoder.damaged

    def put(self, arrived: Arrived) -> None:
        """Have a unit decoded; never waits.

        Raises:
            SourceError: as `check`.
            RuntimeError: likewise.
        """
        self.check()
        self._backlog.put(arrived)

    def check(self) -> None:
        """Nothing, as long as decoding works.

        Raises:
            SourceError: the codec is none that is decoded, or the pictures are too large.
            RuntimeError: the thread died of a defect, which Python has printed.
        """
        if self._error is not None:
            raise self._error
        if not self._task.is_running:
            raise RuntimeError(f"{self._task.name}: died; its error is in the log above")

    def finish(self, stop: threading.Event) -> SourceError | None:
        """Wait until what waits is decoded, and what the decoders hold back; or for `stop`.

        Returns:
            Why pictures could not be decoded, if so.
        """
        self._backlog.close(finish=True)
        while not stop.is_set() and not self._task.join(IDLE_S):
            pass
        return self._error

    def close(self) -> None:
        """End after the picture that is being decoded, and wait for it.

        Raises:
            RuntimeError: it did not end within `CLOSE_S`.
        """
        self._backlog.close(finish=False)
        if not self._task.join(CLOSE_S):
            raise RuntimeError(f"{self._task.name}: did not end within {CLOSE_S:g} s")

    def _run(self, _task: Task[None]) -> None:
        try:
            while (arrived := self._backlog.take()) is not None:
                self._take(arrived)
            for decoded in self._decoder.flush():
                self._give(decoded)
        except SourceError as error:
            self._error = error
            self._backlog.close(finish=False)

    def _take(self, arrived: Arrived) -> None:
        unit = arrived.unit
        if arrived.after_gap:
            self._decoder.leave_out(unit.track)
        self._taken.append((arrived.number, arrived.t_ns, unit.pts_ns))
        decoded = self._decoder.decode(unit, arrived.number)
        if decoded is not None:
            self._give(decoded)

    def _give(self, decoded: Decoded) -> None:
        """A picture, once every track has one, with the times of its own unit."""
        own = (taken for taken in self._taken if taken[0] == decoded.number)
        seq, t_ns, pts_ns = next(own, self._taken[-1])
        self._hand_out(Received(seq, t_ns, self._clock.now_ns(), pts_ns, decoded.pictures))


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
