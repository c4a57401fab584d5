"""A worker of which only the newest request counts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from scenes.workers.task import Task

R = TypeVar("R")


class Latest(Generic[R]):
    """Works on one request at a time; of those that come meanwhile, only the newest is kept.

    A request that was begun is finished, unless the work gives it up once it is stale: requests
    that never stop coming still get answers.

    Args:
        name: of the thread, which starts at once.
        work: does one request; is given an event that is set once the request is stale: a newer
            one waits, or none counts any more.
        failed: takes an error of the work, on the worker's thread, and the next request is served.
            Without it an error ends the worker, and is told as the error of any thread.
        began: called first, on the worker's thread; its error ends the worker in any case.
        ended: called last, on the worker's thread, whatever happened.
    """

    def __init__(
        self,
        name: str,
        work: Callable[[R, threading.Event], None],
        *,
        failed: Callable[[Exception], None] | None = None,
        began: Callable[[], None] = lambda: None,
        ended: Callable[[], None] = lambda: None,
    ) -> None:
        self._work, self._failed = work, failed
        self._began, self._ended = began, ended
        self._changed = threading.Condition()
        self._waiting: list[R] = []
        self._in_hand: threading.Event | None = None
        """Of the request that is worked on: whether it is stale."""
        self._is_closed = False
        self._task = Task(name, self._run).start()

    @property
    def is_busy(self) -> bool:
        """Whether a request is worked on or waits."""
        with self._changed:
            return bool(self._waiting) or self._in_hand is not None

    def ask(self, request: R) -> bool:
        """Want this and none that was asked for before; return whether it can still be served."""
        with self._changed:
            if self._is_closed:
                return False
            self._forget()
            self._waiting.append(request)
            self._changed.notify_all()
            return True

    def cancel(self) -> None:
        """Want nothing; what is worked on is stale."""
        with self._changed:
            self._forget()

    def close(self, timeout_s: float | None = None, *, serves_last: bool = False) -> bool:
        """End after the request in hand; return whether it has ended.

        Args:
            timeout_s: longest wait, seconds; None for no limit.
            serves_last: whether a request that waits is served before, instead of dropped.
        """
        with self._changed:
            self._is_closed = True
            if not serves_last:
                self._forget()
            self._changed.notify_all()
        return self._task.join(timeout_s)

    def _forget(self) -> None:
        self._waiting.clear()
        if self._in_hand is not None:
            self._in_hand.set()

    def _run(self, _task: Task[None]) -> None:
        try:
            self._began()
            while self._serve_next():
                pass
        finally:
            with self._changed:
                self._is_closed = True
                self._waiting.clear()
                self._in_hand = None
            self._ended()

    def _serve_next(self) -> bool:
        """Serve one request, of which nothing is held afterwards; return whether there was one."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._waiting) or self._is_closed)
            if not self._waiting:
                return False
            request, stale = self._waiting.pop(), threading.Event()
            self._in_hand = stale
        try:
            self._work(request, stale)
        except Exception as error:
            if self._failed is None:
                raise
            self._failed(error)
        finally:
            with self._changed:
                self._in_hand = None
        return True
