"""Frames take time from the camera to the session, some longer than others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sim.faults.fault import Passage, WayFault
from sim.tables import Table

USUAL_MS = 60.0
"""Capture to arrival of a good 360° camera on a wire, milliseconds."""

USUAL_JITTER_MS = 6.0
"""Standard deviation of that, milliseconds."""


@dataclass(frozen=True, slots=True)
class Delay(WayFault):
    """The delay of every frame.

    Attributes:
        delay_ms: mean.
        jitter_ms: standard deviation.
    """

    name: ClassVar[str] = "delay_ms"
    sizes: ClassVar[Mapping[str, str]] = {"delay_ms": "ms", "jitter_ms": "ms"}

    delay_ms: float = USUAL_MS
    jitter_ms: float = USUAL_JITTER_MS

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        return cls(
            table.number("delay_ms", USUAL_MS, low=0.0, high=10_000.0),
            table.number("jitter_ms", USUAL_JITTER_MS, low=0.0, high=1_000.0),
        )

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`; the usual delay is no fault."""
        del t_s
        is_usual = (self.delay_ms, self.jitter_ms) == (USUAL_MS, USUAL_JITTER_MS)
        return 0.0 if is_usual else self.delay_ms

    def passed(self, passage: Passage, rng: np.random.Generator) -> Passage:
        """See `WayFault.passed`."""
        delay_ms = max(0.0, rng.normal(self.delay_ms, self.jitter_ms))
        return replace(passage, delay_ns=round(delay_ms * 1e6))
