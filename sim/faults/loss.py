"""Frames that never arrive: by number, by chance, and several in a row."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sim.faults.fault import Passage, WayFault
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
