"""Faults that begin at a time and last for a while: their sizes, their text, and refusals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, TypeVar

LONGEST_S = 24 * 3600.0
"""Latest begin of a fault, seconds: a day."""

KEYS = ("at", "for", "size")
"""Keys of a fault: begin and duration in seconds, and its size."""


class FaultError(ValueError):
    """A fault that there is not: its value, and what is wanted."""


@dataclass(frozen=True, slots=True)
class FaultRange:
    """Range of a fault's size.

    Attributes:
        unit: of the size, empty where it has none.
        usual: size that is taken where none is given.
        low: smallest.
        high: largest.
        usual_for_s: how long it lasts where nothing is said; infinite to the end.
    """

    unit: str
    usual: float
    low: float
    high: float
    usual_for_s: float


@dataclass(frozen=True, slots=True)
class TimedFault:
    """One fault; classes of it say in `ranges` which kinds there are.

    Attributes:
        kind: of those in `ranges`.
        at_s: begin, seconds from when faults are counted.
        for_s: duration.
        size: in the unit of its range.

    Raises:
        FaultError: a value is out of range.
    """

    ranges: ClassVar[Mapping[Any, FaultRange]] = {}

    kind: StrEnum
    at_s: float
    for_s: float
    size: float

    def __post_init__(self) -> None:
        allowed = self.ranges[self.kind]
        if not 0.0 <= self.at_s <= LONGEST_S:
            raise FaultError(f"fault {self.kind}: at={self.at_s:g}, wanted 0 to {LONGEST_S:g} s")
        if not self.for_s > 0.0:
            raise FaultError(f"fault {self.kind}: for={self.for_s:g}, wanted more than 0 s")
        if not allowed.low <= self.size <= allowed.high:
            wanted = f"{allowed.low:g} to {allowed.high:g} {allowed.unit}".rstrip()
            raise FaultError(f"fault {self.kind}: size={self.size:g}, wanted {wanted}")

    @property
    def end_s(self) -> float:
        """When it is over."""
        return self.at_s + self.for_s

    def holds(self, t_s: float) -> bool:
        """Return whether it is there at a moment."""
        return self.at_s <= t_s < self.end_s


AnyFault = TypeVar("AnyFault", bound=TimedFault)


def read_timed_faults(
    of: type[AnyFault], texts: Iterable[str], *, most: int
) -> tuple[AnyFault, ...]:
    """Return the faults of some texts, see `read_timed_fault`.

    Raises:
        FaultError: one is none, or there are more than `most`.
    """
    faults = tuple(read_timed_fault(of, text) for text in texts)
    check_count(len(faults), most=most)
    return faults


def check_count(count: int, *, most: int) -> None:
    """Refuse more than so many.

    Raises:
        FaultError: there are more.
    """
    if count > most:
        raise FaultError(f"faults: {count}, wanted at most {most}")


def read_timed_fault(of: type[AnyFault], text: str) -> AnyFault:
    """Return the fault of `KIND:at=SECONDS,for=SECONDS,size=VALUE`; all but the kind is optional.

    Raises:
        FaultError: it is none; says what is wanted.
    """
    kind, _, rest = text.strip().partition(":")
    values: dict[str, Any] = {}
    for part in filter(None, (part.strip() for part in rest.split(","))):
        key, mark, value = part.partition("=")
        if not mark:
            wanted = ", ".join(f"{known}=…" for known in KEYS)
            raise FaultError(f"fault {text!r}: {part!r}, wanted {wanted}")
        try:
            values[key.strip()] = float(value)
        except ValueError:
            raise FaultError(f"fault {text!r}: {key.strip()}={value!r}, wanted a number") from None
    return fault_of_values(of, kind.strip(), values=values, source=f"fault {text!r}")


def fault_of_values(
    of: type[AnyFault], kind: object, *, values: Mapping[str, Any], source: str
) -> AnyFault:
    """Return the fault of a kind's name and values by `KEYS`, of which any may be left out.

    Raises:
        FaultError: it is none; names the source, and says what is wanted.
    """
    known = {str(each): each for each in of.ranges}.get(str(kind))
    if known is None:
        raise FaultError(f"{source}: kind {kind!r}, wanted one of {', '.join(of.ranges)}")
    for key, value in values.items():
        if key not in KEYS:
            raise FaultError(f"{source}: {key!r}, wanted some of {', '.join(KEYS)}")
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            raise FaultError(f"{source}: {key}={value!r}, wanted a number")
    usual = of.ranges[known]
    return of(
        known,
        float(values.get("at", 0.0)),
        float(values.get("for", usual.usual_for_s)),
        float(values.get("size", usual.usual)),
    )
