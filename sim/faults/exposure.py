"""The camera exposes longer or shorter than the room needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

from sim.faults.fault import LightFault, Picture
from sim.faults.light import with_gains
from sim.faults.span import Span, read_span
from sim.tables import Table


@dataclass(frozen=True, slots=True)
class Exposure(LightFault):
    """Brighter or darker pictures.

    Attributes:
        ev: steps of exposure; +1 is twice the light.
        span: when.
    """

    name: ClassVar[str] = "exposure"
    sizes: ClassVar[Mapping[str, str]] = {"ev": "EV"}

    ev: float
    span: Span = field(default_factory=Span)

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(table.number("ev", low=-4.0, high=4.0), read_span(table))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        return self.ev if self.span.holds(t_s) else 0.0

    def described(self) -> str:
        """See `Fault.described`."""
        return f"the exposure is off by {self.ev:+g} EV"

    def seen(self, pictures: Sequence[Picture], t_s: float) -> tuple[Picture, ...]:
        """See `LightFault.seen`."""
        del t_s
        return with_gains(pictures, [2.0**self.ev] * 3)
