"""How long each stage took: the last so many durations, and their percentiles."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from studio.console.rows import Row

KEPT = 20_000
"""Durations kept per stage: half an hour of a session at 10 Hz."""


@dataclass(frozen=True, slots=True)
class StageTime:
    """Percentiles of one stage, milliseconds, over `count` frames."""

    name: str
    p50_ms: float
    p95_ms: float
    count: int


class Latencies:
    """Collects durations by stage name, in the order in which the stages were first seen.

    One thread adds; any thread may read.
    """

    def __init__(self) -> None:
        self._durations: dict[str, deque[int]] = {}

    def add(self, stage_ns: Mapping[str, int], *, prefix: str = "") -> None:
        """Take durations in nanoseconds by stage; `prefix` and a dot go before the names."""
        for name, duration_ns in stage_ns.items():
            full = f"{prefix}.{name}" if prefix else name
            self._durations.setdefault(full, deque(maxlen=KEPT)).append(duration_ns)

    def stages(self) -> tuple[StageTime, ...]:
        """Percentiles of every stage."""
        out = []
        for name, durations in tuple(self._durations.items()):
            p50, p95 = np.percentile(np.array(tuple(durations), dtype=np.float64) / 1e6, [50, 95])
            out.append(StageTime(name, float(p50), float(p95), len(durations)))
        return tuple(out)

    def rows(self) -> list[Row]:
        """`stage.NAME.ms.p50` and `.p95` of every stage."""
        rows = []
        for stage in self.stages():
            rows.append(Row(f"stage.{stage.name}.ms.p50", stage.p50_ms, "ms"))
            rows.append(Row(f"stage.{stage.name}.ms.p95", stage.p95_ms, "ms"))
        return rows
