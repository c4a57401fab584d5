"""Work on a thread of its own, whose end the window polls for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from devices.streams import Slot

T = TypeVar("T")

Report = Callable[[float], None]
"""Takes the share that is done, 0..1."""


class Task(Generic[T]):
    """One piece of work.

    Args:
        name: of the thread.
        work: is given a function that takes the share that is done, and an event that asks it to
            stop.
    """

    def __init__(self, name: str, work: Callable[[Report, threading.Event], T]) -> None:
        self.share: Slot[float] = Slot()
        self.result: T | None = None
        self.failure: str | None = None
        """The failure, in words."""
        self._work = work
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        """Whether it is still at work."""
        return self._thread.is_alive()

    @property
    def is_cancelled(self) -> bool:
        """Whether it was asked to stop."""
        return self._cancelled.is_set()

    def cancel(self) -> None:
        """Ask it to stop, without waiting for it."""
        self._cancelled.set()

    def join(self) -> None:
        """Wait for its end."""
        self._thread.join()

    def _run(self) -> None:
        try:
            self.result = self._work(self.share.put, self._cancelled)
        except Exception as error:  # noqa: BLE001 - shown in the window, which lives on
            self.failure = str(error) or type(error).__name__
