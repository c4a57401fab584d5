"""How messages get from an adapter to the stages: exactly on one thread, or paced by a clock."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Protocol, TypeVar

from devices.adapter import IteratorDevice, Timed
from devices.clock import Clock
from devices.recording import Recorder
from devices.recording_codec import RecordedValue
from devices.streams import BoundedQueue, Slot, StreamClosedError
from scenes.workers.task import Task

M = TypeVar("M", bound=Timed)

RECORDER_QUEUE = 1024
"""Messages that may wait for the disk: some ten seconds of a session."""


CANCEL_POLL_S = 0.1
"""How long a paced session may take to notice that it was cancelled."""


class CancelledError(Exception):
    """The user stopped the session."""


class Executor(Protocol):
    """Runs a session's messages through its stages."""

    def run(
        self,
        messages: Callable[[], Iterator[M]],
        *,
        entered: Callable[[M], None],
        step: Callable[[M], None],
        cancelled: threading.Event,
    ) -> int:
        """Take every message to `entered`, and those that are not dropped to `step`.

        Args:
            messages: called once; yields in order of time.
            entered: sees every message, in order; on the adapter's thread.
            step: the stages; on the caller's thread.
            cancelled: set to stop early.

        Returns:
            How many messages were dropped between the two.

        Raises:
            CancelledError: `cancelled` was set.
            Exception: whatever the messages, `entered` or `step` raise.
        """
        ...


class ExactExecutor:
    """One thread, nothing dropped: the same messages always give the same results."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def run(
        self,
        messages: Callable[[], Iterator[M]],
        *,
        entered: Callable[[M], None],
        step: Callable[[M], None],
        cancelled: threading.Event,
    ) -> int:
        """See `Executor.run`; always returns 0."""
        for message in messages():
            if cancelled.is_set():
                raise CancelledError
            self._clock.sleep_until(message.t_ns)
            entered(message)
            step(message)
        return 0


class PacedExecutor:
    """The adapter on its own thread keeps the clock's time; the stages get the latest message."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def run(
        self,
        messages: Callable[[], Iterator[M]],
        *,
        entered: Callable[[M], None],
        step: Callable[[M], None],
        cancelled: threading.Event,
    ) -> int:
        """See `Executor.run`."""
        slot: Slot[M] = Slot()

        def tee() -> Iterator[M]:
            for message in messages():
                entered(message)
                yield message

        device = IteratorDevice("session source", tee)
        device.start(slot, self._clock)
        try:
            while True:
                if cancelled.is_set():
                    raise CancelledError
                ended = slot.closed  # asked before taking: what came before the end is still taken
                message = slot.take(timeout_s=CANCEL_POLL_S)
                if message is not None:
                    step(message)
                elif ended:
                    break
        finally:
            device.stop()
        if device.failure is not None:
            raise device.failure
        return slot.dropped


class RecorderThread:
    """Lets a session write from several threads without waiting for the disk.

    Use as a context manager around the recorder's own.

    Args:
        recorder: written by this object's thread only.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._queue: BoundedQueue[RecordedValue] = BoundedQueue(RECORDER_QUEUE, name="recorder")
        self._failure: Exception | None = None
        self._task = Task("recorder", self._write)

    def write(self, value: RecordedValue) -> None:
        """Hand over one message.

        Raises:
            StreamFullError: the disk is too slow.
            OSError: writing failed earlier.
        """
        try:
            self._queue.put(value, timeout_s=2.0)
        except StreamClosedError:
            if self._failure is not None:
                raise self._failure from None
            raise

    def offer(self, value: RecordedValue) -> None:
        """Hand over one message without waiting.

        Raises:
            StreamFullError: the disk is too slow.
            StreamClosedError: writing failed earlier, or the recording ended.
        """
        self._queue.put(value)

    def _write(self, _task: Task[None]) -> None:
        try:
            while (value := self._queue.take(timeout_s=None)) is not None:
                self._recorder.write(value)
        except (OSError, ValueError) as error:
            self._failure = error
            self._queue.close()

    def __enter__(self) -> RecorderThread:
        self._task.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_rest: object) -> None:
        self._queue.close()
        self._task.join()
        if kind is None and self._failure is not None:
            raise self._failure
