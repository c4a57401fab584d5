"""Session time. Everything that needs the time is handed a clock; nothing else reads one."""

from __future__ import annotations

import threading
import time
from typing import Protocol


class Clock(Protocol):
    """Session time in nanoseconds."""

    def now_ns(self) -> int:
        """Nanoseconds since the session began."""
        ...

    def sleep_until(self, t_ns: int) -> None:
        """Return once `now_ns() >= t_ns`."""
        ...


class WallClock:
    """Real time, monotonic, zero when made."""

    def __init__(self) -> None:
        self._zero_ns = time.perf_counter_ns()

    def now_ns(self) -> int:
        """Nanoseconds since the clock was made."""
        return time.perf_counter_ns() - self._zero_ns

    def sleep_until(self, t_ns: int) -> None:
        """Block until then; a time in the past returns at once."""
        wait_ns = t_ns - self.now_ns()
        if wait_ns > 0:
            time.sleep(wait_ns / 1e9)


class ManualClock:
    """A clock that stands still until it is moved: exact rehearsal, replay and tests.

    Sleeping moves it, so that one thread can play a session faster than real time.
    """

    def __init__(self, now_ns: int = 0) -> None:
        self._now_ns = now_ns
        self._lock = threading.Lock()

    def now_ns(self) -> int:
        """The time it was moved to."""
        return self._now_ns

    def sleep_until(self, t_ns: int) -> None:
        """Move forward to `t_ns`; never back."""
        with self._lock:
            self._now_ns = max(self._now_ns, t_ns)
