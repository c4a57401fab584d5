"""Somebody hides the code on the camera, so nobody knows where the camera is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sim.faults.fault import Passage, WayFault
from sim.faults.span import Span, read_span
from sim.tables import Table

NANOSECONDS = 1_000_000_000


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
