"""The camera delivers its last picture again and again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from sim.faults.fault import Fault
from sim.faults.span import Span, read_span
from sim.tables import Table


@dataclass(frozen=True, slots=True)
class Freeze(Fault):
    """Frames go on, but all show what the last one before the span showed."""

    name: ClassVar[str] = "freeze"
    sizes: ClassVar[Mapping[str, str]] = {"lasts_s": "s"}

    span: Span

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(read_span(table))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`: seconds since the picture froze, 0 outside the span."""
        return max(t_s - self.span.from_s, 1e-3) if self.span.holds(t_s) else 0.0

    def described(self) -> str:
        """See `Fault.described`."""
        return "the camera's picture is frozen"
