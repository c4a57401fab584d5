"""From when to when a fault is there."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sim.tables import Table

LONGEST_S = 3600.0
"""A scenario's longest duration, seconds."""


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a rehearsal, in seconds from its start.

    Attributes:
        from_s: first moment.
        to_s: the moment after it; infinite to the end.
    """

    from_s: float = 0.0
    to_s: float = math.inf

    def holds(self, t_s: float) -> bool:
        """Whether a moment is in it."""
        return self.from_s <= t_s < self.to_s

    @property
    def lasts_s(self) -> float:
        """How long it is."""
        return self.to_s - self.from_s


def read_span(table: Table) -> Span:
    """A span from `from_s` and either `to_s` or `lasts_s`; without these, the whole rehearsal.

    Raises:
        ScenarioError: a value is wrong, it ends before it begins, or both ends are given.
    """
    from_s = table.number("from_s", 0.0, low=0.0, high=LONGEST_S)
    to_s = table.optional_number("to_s", 0.0, LONGEST_S)
    lasts_s = table.optional_number("lasts_s", 0.0, LONGEST_S)
    if to_s is not None and lasts_s is not None:
        raise table.error("lasts_s", lasts_s, "either to_s or lasts_s, not both")
    if to_s is not None and to_s < from_s:
        raise table.error("to_s", to_s, f"a time from from_s = {from_s:g} on")
    if lasts_s is not None:
        return Span(from_s, from_s + lasts_s)
    return Span(from_s, math.inf if to_s is None else to_s)
