"""Somebody bumps into the camera, which its code does not show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from sim.faults.fault import Fault
from sim.tables import Table

USUAL_DEG = 0.6
USUAL_CM = 0.5


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
    deg: float = USUAL_DEG
    cm: float = USUAL_CM

    @classmethod
    def read(cls, table: Table) -> Self | None:
        """See `Fault.read`."""
        at_s = table.optional_number("bump_s", 0.0, 3600.0)
        deg = table.number("bump_deg", USUAL_DEG, low=0.0, high=10.0)
        cm = table.number("bump_cm", USUAL_CM, low=0.0, high=30.0)
        return None if at_s is None else cls(at_s, deg, cm)

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`: degrees, from the bump on."""
        return self.deg if t_s >= self.at_s else 0.0
