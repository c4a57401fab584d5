"""Faults of the devices: the camera is bumped or its picture freezes, a headset is taken off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Self

from sim.faults.fault import Fault, Span, Stage, read_span
from sim.tables import Table

USUAL_BUMP_DEG = 0.6
USUAL_BUMP_CM = 0.5


@dataclass(frozen=True, slots=True)
class Bump(Fault):
    """The camera is turned and shifted at once, and stays so.

    Attributes:
        at_s: when.
        deg: how far it is turned, about a random axis.
        cm: how far it is shifted, in a random direction.
    """

    name: ClassVar[str] = "bump"
    sizes: ClassVar[Mapping[str, str]] = {"bump_deg": "°", "bump_cm": "cm"}

    at_s: float
    deg: float = USUAL_BUMP_DEG
    cm: float = USUAL_BUMP_CM

    @classmethod
    def read(cls, table: Table) -> Self | None:
        """See `Fault.read`."""
        at_s = table.optional_number("bump_s", 0.0, 3600.0)
        deg = table.number("bump_deg", USUAL_BUMP_DEG, low=0.0, high=10.0)
        cm = table.number("bump_cm", USUAL_BUMP_CM, low=0.0, high=30.0)
        return None if at_s is None else cls(at_s, deg, cm)

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`: degrees, from the bump on."""
        return self.deg if t_s >= self.at_s else 0.0


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
