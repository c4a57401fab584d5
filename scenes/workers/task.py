"""One piece of work on a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, Self, TypeVar, cast

T = TypeVar("T")

Expected = type[BaseException] | tuple[type[BaseException], ...]


class Task(Generic[T]):
    """A function on a thread: its progress, its cancelling, and its result or error.

    It runs once, from `start` on. The thread is a daemon: it keeps no program from ending.

    Args:
        name: of the thread.
        work: is given the task itself, whose `cancelled` it should look at often.
        expected: errors that belong to the result. Any other is a defect: it is kept likewise, and
            also told to `threading.excepthook` as the error of any thread.
        is_awaited: whether the program waits for it at its end, for files to become whole.

    Attributes:
        cancelled: set once it shall end.
        share: the part that is done, 0..1, as the work has reported it last.
        result: what the work returned; None before its end and after an error.
        error: what the work raised; None where it raised nothing.
    """

    def __init__(
        self,
        name: str,
        work: Callable[[Task[T]], T],
        *,
        expected: Expected = (),
        is_awaited: bool = False,
    ) -> None:
        self.cancelled = threading.Event()
        self.share = 0.0
        self.result: T | None = None
        self.error: BaseException | None = None
        self._work = work
        self._expected = expected
        self._thread = threading.Thread(target=self._run, name=name, daemon=not is_awaited)

    def start(self) -> Self:
        """Begin; returns the task.

        Raises:
            RuntimeError: it was started before.
        """
        self._thread.start()
        return self

    @property
    def name(self) -> str:
        """Name of the thread."""
        return self._thread.name

    @property
    def thread_id(self) -> int | None:
        """Identifier of the thread; None before it was started."""
        return self._thread.ident

    @property
    def is_running(self) -> bool:
        """Whether it is at work."""
        return self._thread.is_alive()

    @property
    def is_cancelled(self) -> bool:
        """Whether it was asked to end."""
        return self.cancelled.is_set()

    @property
    def problem(self) -> str:
        """Error of the work in words; empty where there is none."""
        return "" if self.error is None else str(self.error) or type(self.error).__name__

    def cancel(self) -> None:
        """Ask it to end, without waiting for it."""
        self.cancelled.set()

    def join(self, timeout_s: float | None = None) -> bool:
        """Wait for its end; return whether nothing of it runs.

        The task itself does not wait: on its own thread the answer is no, at once.

        Args:
            timeout_s: longest wait, seconds; None for no limit.
        """
        if self._thread is threading.current_thread():
            return False
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def outcome(self) -> T:
        """Wait for the result of a started task.

        Raises:
            BaseException: what the work raised.
        """
        self.join()
        if self.error is not None:
            raise self.error
        return cast(T, self.result)

    def pause(self, seconds: float) -> bool:
        """Wait so long, less once it is cancelled; return whether it is."""
        return self.cancelled.wait(seconds)

    def report(self, share: float) -> None:
        """Say how much is done, 0..1."""
        self.share = share

    def _run(self) -> None:
        try:
            self.result = self._work(self)
        except BaseException as error:
            self.error = error
            if not isinstance(error, self._expected):
                raise
