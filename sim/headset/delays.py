"""Delays of messages, counted in bins: any number of them in the same memory."""

from __future__ import annotations

from array import array

import numpy as np

BIN_MS = 0.05
"""Width of a bin, chosen: a hundredth of the smallest figure that is asked for, 5 ms."""

BINS = 200_000
"""Bins: up to ten seconds; what took longer is in the last."""


class Delays:
    """Delays so far."""

    def __init__(self) -> None:
        self._counts = array("Q", bytes(8 * BINS))
        self.count = 0

    def add(self, delay_ms: float) -> None:
        """Take one; below zero, which clocks of two machines can give, counts as zero."""
        self._counts[min(max(int(delay_ms / BIN_MS), 0), BINS - 1)] += 1
        self.count += 1

    def percentile(self, share: float) -> float | None:
        """Return the delay, ms, that so many percent do not exceed; None before the first."""
        if not self.count:
            return None
        reached = np.cumsum(np.frombuffer(self._counts, dtype=np.uint64))
        place = int(np.searchsorted(reached, max(share / 100.0 * self.count, 1.0)))
        return (place + 0.5) * BIN_MS
