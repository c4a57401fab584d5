"""Durations of a live session's parts, gathered from any thread: the last ones, and percentiles."""

from __future__ import annotations

import threading
from collections import deque

import numpy as np

KEPT = 40_000
"""Durations that are kept of each: of ten minutes at 60 Hz."""


class Durations:
    """The last durations of one thing, in milliseconds."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: deque[float] = deque(maxlen=KEPT)

    def add(self, milliseconds: float) -> None:
        """Take one."""
        with self._lock:
            self._kept.append(milliseconds)

    def percentile(self, percent: float) -> float | None:
        """Return a percentile; None before the first."""
        with self._lock:
            kept = list(self._kept)
        return float(np.percentile(kept, percent)) if kept else None

    def clear(self) -> None:
        """Forget all."""
        with self._lock:
            self._kept.clear()

    def __len__(self) -> int:
        """Return how many there are."""
        with self._lock:
            return len(self._kept)
