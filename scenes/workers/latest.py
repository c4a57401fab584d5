"""A worker of which only the newest request counts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from scenes.workers.task import Task

R = TypeVar("R")

IsStale = Callable[[], bool]
"""Whether a newer request came since, or the worker is being closed."""


class Latest(Generic[R]):
    """Works on one request at a time; of those that come meanwhile, only the newest is kept.

    A request that was begun is finished, unless the work gives it up when it is stale: requests
    that never stop coming still get answers.

    Args:
        name: of the thread, which starts at once.
        work: does one request.
        failed: takes an error of the work, on the worker's thread; the next request is served.
        ended: called last, on the worker's thread, to give back what the work has opened.
    """

    def __init__(
        self,
        name: str,
        work: Callable[[R, IsStale], None],
        *,
        failed: Callable[[Exception], None],
        ended: Callable[[], None] = lambda: None,
    ) -> None:
        self._work, self._failed, self._ended = work, failed, ended
        self._changed = threading.Condition()
        self._waiting: list[R] = []
        self._is_closed = False
        self._task = Task(name, self._run).start()

    def ask(self, request: R) -> bool:
        """Want this and none that was asked for before; return whether it can still be served."""
        with self._changed:
            if self._is_closed:
                return False
            self._waiting[:] = [request]
            self._changed.notify_all()
            return True

    def close(self, timeout_s: float | None = None) -> bool:
        """End after the request in hand, dropping the one that waits; return whether it has ended.

        Args:
            timeout_s: longest wait, seconds; None for no limit.
        """
        with self._changed:
            self._is_closed = True
            self._waiting.clear()
            self._changed.notify_all()
        return self._task.join(timeout_s)

    @property
    def is_stale(self) -> bool:
        """Whether a newer request waits, or none counts any more."""
        return self._is_closed or bool(self._waiting)

    def _run(self, _task: Task[None]) -> None:
        try:
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: self.is_stale)
                    if self._is_closed:
                        return
                    request = self._waiting.pop()
                try:
                    self._work(request, lambda: self.is_stale)
                except Exception as error:  # noqa: BLE001 - whoever asked is told
                    self._failed(error)
                # A large request is not held while the next one is awaited.
                del request
        finally:
            with self._changed:
                self._is_closed = True
            self._ended()
