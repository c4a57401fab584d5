"""How long each stage took: the last so many durations, and their percentiles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        self._durations: dict[str, _Ring] = {}

    def add(self, stage_ns: Mapping[str, int], *, prefix: str = "") -> None:
        """Take durations in nanoseconds by stage; `prefix` and a dot go before the names."""
        for name, duration_ns in stage_ns.items():
            full = f"{prefix}.{name}" if prefix else name
            self._durations.setdefault(full, _Ring()).add(duration_ns)

    def newest(self, name: str, *, last: int = KEPT) -> NDArray[np.int64]:
        """The last durations of one stage, ns, oldest first; empty if there is no such stage."""
        durations = self._durations.get(name)
        return np.zeros(0, np.int64) if durations is None else durations.newest(last)

    def stages(self, *, last: int = KEPT) -> tuple[StageTime, ...]:
        """Percentiles of every stage.

        Args:
            last: durations of each that count; a window that shows them all the time asks for few,
                so that it takes no longer after hours.
        """
        out = []
        for name, durations in tuple(self._durations.items()):
            newest_ms = durations.newest(last) / 1e6
            p50, p95 = np.percentile(newest_ms, [50, 95])
            out.append(StageTime(name, float(p50), float(p95), len(newest_ms)))
        return tuple(out)

    def rows(self) -> list[Row]:
        """`stage.NAME.ms.p50` and `.p95` of every stage."""
        rows = []
        for stage in self.stages():
            rows.append(Row(f"stage.{stage.name}.ms.p50", stage.p50_ms, "ms"))
            rows.append(Row(f"stage.{stage.name}.ms.p95", stage.p95_ms, "ms"))
        return rows


class _Ring:
    """The last `KEPT` durations of a stage, ns."""

    def __init__(self) -> None:
        self._values = np.zeros(KEPT, dtype=np.int64)
        self._count = 0

    def add(self, duration_ns: int) -> None:
        self._values[self._count % KEPT] = duration_ns
        self._count += 1

    def newest(self, most: int) -> NDArray[np.int64]:
        count = self._count
        wanted = min(most, count, KEPT)
        return self._values[np.arange(count - wanted, count) % KEPT]
