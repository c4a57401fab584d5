"""The camera's clock runs fast or slow against the session's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sim.faults.fault import Passage, WayFault
from sim.tables import Table

FASTEST_PPM = 5000.0
"""A quartz is within 100 ppm; a clock of interrupts that are missed goes this wrong."""


@dataclass(frozen=True, slots=True)
class ClockDrift(WayFault):
    """The capture times that the camera reports drift; both clocks agree at the start.

    Attributes:
        ppm: microseconds a second that the camera's clock gains.
    """

    name: ClassVar[str] = "clock_drift_ppm"
    sizes: ClassVar[Mapping[str, str]] = {"clock_drift_ppm": "ppm"}

    ppm: float

    @classmethod
    def read(cls, table: Table) -> Self | None:
        """See `Fault.read`."""
        ppm = table.number("clock_drift_ppm", 0.0, low=-FASTEST_PPM, high=FASTEST_PPM)
        return cls(ppm) if ppm else None

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        del t_s
        return self.ppm

    def described(self) -> str:
        """See `Fault.described`."""
        return f"the camera's clock drifts by {self.ppm:g} ppm"

    def passed(self, passage: Passage, rng: np.random.Generator) -> Passage:
        """See `WayFault.passed`."""
        del rng
        return replace(passage, stamp_ns=round(passage.stamp_ns * (1.0 + 1e-6 * self.ppm)))
