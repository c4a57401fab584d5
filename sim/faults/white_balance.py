"""The camera takes the light for warmer or colder than it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

from sim.faults.fault import LightFault, Picture
from sim.faults.light import with_gains
from sim.faults.span import Span, read_span
from sim.tables import Table


@dataclass(frozen=True, slots=True)
class WhiteBalance(LightFault):
    """Redder or bluer pictures.

    Attributes:
        warmth: red light is multiplied by 1 + `warmth`, blue divided by it; below 0 it is colder.
        span: when.
    """

    name: ClassVar[str] = "white_balance"
    sizes: ClassVar[Mapping[str, str]] = {"warmth": "share"}

    warmth: float
    span: Span = field(default_factory=Span)

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(table.number("warmth", low=-0.6, high=1.5), read_span(table))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        return self.warmth if self.span.holds(t_s) else 0.0

    def described(self) -> str:
        """See `Fault.described`."""
        return f"the white balance is off by {self.warmth:+.0%} red"

    def seen(self, pictures: Sequence[Picture], t_s: float) -> tuple[Picture, ...]:
        """See `LightFault.seen`."""
        del t_s
        return with_gains(pictures, [1.0 + self.warmth, 1.0, 1.0 / (1.0 + self.warmth)])
