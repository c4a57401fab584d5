"""Faults on the way from the camera: frames are lost, late, stamped wrongly or without its pose."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sim.faults.fault import Passage, Span, WayFault, read_span
from sim.tables import Table

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Loss(WayFault):
    """Single frames that are lost.

    Attributes:
        dropped_frames: sequence numbers that never arrive.
        drop_share: chance of any other frame not to arrive, 0..1.
    """

    name: ClassVar[str] = "drop_share"
    sizes: ClassVar[Mapping[str, str]] = {"drop_share": "share"}

    dropped_frames: frozenset[int] = frozenset()
    drop_share: float = 0.0

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        return cls(
            frozenset(table.integers("dropped_frames")),
            table.number("drop_share", 0.0, low=0.0, high=0.9),
        )

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        del t_s
        return self.drop_share

    def passed(self, passage: Passage, rng: np.random.Generator) -> Passage:
        """See `WayFault.passed`."""
        is_lost = bool(rng.random() < self.drop_share) or passage.seq in self.dropped_frames
        return replace(passage, is_lost=passage.is_lost or is_lost)


@dataclass(frozen=True, slots=True)
class Burst(WayFault):
    """All frames of a while are lost, again and again.

    Attributes:
        lasts_s: how long each burst is.
        every_s: from the beginning of one to that of the next.
        from_s: beginning of the first.
    """

    name: ClassVar[str] = "burst"
    sizes: ClassVar[Mapping[str, str]] = {"lasts_s": "s"}

    lasts_s: float
    every_s: float = math.inf
    from_s: float = 1.0

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        burst = cls(
            table.number("lasts_s", low=0.0, high=60.0),
            table.optional_number("every_s", 0.1, 3600.0) or math.inf,
            table.number("from_s", 1.0, low=0.0, high=3600.0),
        )
        table.done()
        return burst

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        return self.lasts_s if self._is_within(t_s) else 0.0

    def passed(self, passage: Passage, rng: np.random.Generator) -> Passage:
        """See `WayFault.passed`."""
        del rng
        is_lost = self._is_within(passage.t_ns / NANOSECONDS)
        return replace(passage, is_lost=passage.is_lost or is_lost)

    def _is_within(self, t_s: float) -> bool:
        since_s = round(t_s - self.from_s, 9)
        if since_s < 0.0:
            return False
        within_s = (
            since_s if math.isinf(self.every_s) else round(math.fmod(since_s, self.every_s), 9)
        )
        return within_s < self.lasts_s


USUAL_DELAY_MS = 60.0
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

    delay_ms: float = USUAL_DELAY_MS
    jitter_ms: float = USUAL_JITTER_MS

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        return cls(
            table.number("delay_ms", USUAL_DELAY_MS, low=0.0, high=10_000.0),
            table.number("jitter_ms", USUAL_JITTER_MS, low=0.0, high=1_000.0),
        )

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`; the usual delay is no fault."""
        del t_s
        is_usual = (self.delay_ms, self.jitter_ms) == (USUAL_DELAY_MS, USUAL_JITTER_MS)
        return 0.0 if is_usual else self.delay_ms

    def passed(self, passage: Passage, rng: np.random.Generator) -> Passage:
        """See `WayFault.passed`."""
        delay_ms = max(0.0, rng.normal(self.delay_ms, self.jitter_ms))
        return replace(passage, delay_ns=round(delay_ms * 1e6))


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


@dataclass(frozen=True, slots=True)
class HiddenCode(WayFault):
    """The code on the camera cannot be seen: frames arrive without the camera's pose."""

    name: ClassVar[str] = "hidden_code"
    sizes: ClassVar[Mapping[str, str]] = {"lasts_s": "s"}

    span: Span

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(read_span(table))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`: 1 while it is hidden."""
        return float(self.span.holds(t_s))

    def described(self) -> str:
        """See `Fault.described`."""
        return "the camera's code is hidden"

    def passed(self, passage: Passage, rng: np.random.Generator) -> Passage:
        """See `WayFault.passed`."""
        del rng
        is_hidden = self.span.holds(passage.t_ns / NANOSECONDS)
        return replace(passage, is_posed=passage.is_posed and not is_hidden)
