"""A local person takes the headset off: still in the room, but no avatar of theirs arrives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Self

from sim.faults.fault import Fault, Stage
from sim.faults.span import Span, read_span
from sim.tables import Table


@dataclass(frozen=True, slots=True)
class HeadsetOff(Fault):
    """No head and hands of one person for a while.

    Attributes:
        person: whose.
        span: when.
    """

    name: ClassVar[str] = "headset_off"
    sizes: ClassVar[Mapping[str, str]] = {"lasts_s": "s"}

    person: str
    span: Span = field(default_factory=Span)

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(table.text("person"), read_span(table))
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`: 1 while it is off."""
        return float(self.span.holds(t_s))

    def described(self) -> str:
        """See `Fault.described`."""
        return f"the headset of {self.person} is off"

    def misfit(self, stage: Stage) -> tuple[str, object, str] | None:
        """See `Fault.misfit`."""
        if self.person in stage.people:
            return None
        return "person", self.person, f"one of {', '.join(stage.people) or '(nobody is there)'}"
