"""Forms of the faults of plug-ins: what a form asks for is what the fault's reader asks for."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

from sim.faults.fault import Fault
from sim.tables import Table
from studio.app.scenario.fields import FAULT_FIELDS, FAULT_TITLES, Field

_TITLES = {"from_s": "from", "to_s": "until", "lasts_s": "lasts"}
_UNITS = {"_s": "s", "_ms": "ms", "_deg": "°", "_px": "px", "_cm": "cm", "_m": "m"}


def fault_fields(more: Mapping[str, type[Fault]]) -> Mapping[str, tuple[Field, ...]]:
    """Fields by fault: the built-in ones, then those of plug-ins."""
    return {**FAULT_FIELDS, **{name: fields_of(kind) for name, kind in more.items()}}


def title_of(name: str) -> str:
    """Return the title of a fault."""
    return FAULT_TITLES.get(name, name.replace("_", " ").capitalize())


def fields_of(kind: type[Fault]) -> tuple[Field, ...]:
    """The numbers that a fault reads from its table, with their ranges: it is let read one."""
    asking = _Asking(kind.sizes)
    # Whatever it does with the answers: what it has asked for until then can be set.
    with contextlib.suppress(Exception):
        kind.read(asking)
    return tuple(asking.fields.values())


class _Asking(Table):
    """A table that notes what is asked for and gives what is usual."""

    def __init__(self, units: Mapping[str, str]) -> None:
        super().__init__({}, "a plug-in's fault", "")
        self.fields: dict[str, Field] = {}
        self._sizes = list(units)
        self._units = dict(units)

    def number(self, key: str, default: Any = None, *, low: float, high: float) -> float:
        """See `Table`."""
        usual = self._usual(key, default, low, high)
        self._note(key, low, high, usual)
        return usual

    def optional_number(self, key: str, low: float, high: float) -> float | None:
        """See `Table`."""
        self._note(key, low, high, None)
        return None

    def integer(self, key: str, default: Any = None, *, low: int, high: int) -> int:
        """See `Table`."""
        usual = round(self._usual(key, default, low, high))
        self._note(key, low, high, usual, is_count=True)
        return usual

    def _usual(self, key: str, default: Any, low: float, high: float) -> float:
        """The default; of the fault's size something that is there, if by default it is not."""
        is_number = isinstance(default, int | float)
        if is_number and (default or key not in self._sizes[:1]):
            return float(default)
        return low + 0.25 * (high - low) if key in self._sizes[:1] else low

    def _note(
        self, key: str, low: float, high: float, usual: float | None, *, is_count: bool = False
    ) -> None:
        ends = (unit for end, unit in _UNITS.items() if key.endswith(end))
        self.fields[key] = Field(
            key,
            _TITLES.get(key, key.replace("_", " ")),
            "count" if is_count else "number",
            unit=self._units.get(key) or next(ends, ""),
            low=low,
            high=high,
            usual=usual,
        )
