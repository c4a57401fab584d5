"""Decoding on a thread of its own, beside the one that reads: a late decoder delays no reading."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from devices.camera.backlog import Arrived, Backlog
from devices.camera.received import Received
from devices.camera.stream_decoder import DecodedPictures, StreamDecoder
from devices.camera.units import IDLE_S, SourceError
from devices.clock import Clock
from scenes.workers.task import Task

CLOSE_S = 5.0
"""Seconds that `close` waits for the thread; a picture of 5760 × 2880 takes it 0.1 s."""

MAX_HELD_BACK = 64
"""Units that a decoder may take before it gives the picture of the first: 16 in H.264 and HEVC, on
up to four tracks."""


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

    def _give(self, decoded: DecodedPictures) -> None:
        """A picture, once every track has one, with the times of its own unit."""
        own = (taken for taken in self._taken if taken[0] == decoded.number)
        seq, t_ns, pts_ns = next(own, self._taken[-1])
        self._hand_out(Received(seq, t_ns, self._clock.now_ns(), pts_ns, decoded.pictures))
