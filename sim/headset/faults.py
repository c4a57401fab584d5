"""Faults between a headset and the hub: their kinds, as text, and which are there at a moment."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class HeadsetFaultKind(StrEnum):
    """Kinds of faults."""

    LOSS = "loss"
    """Bodies are left out by chance."""
    JITTER = "jitter"
    """Bodies are sent later, by chance."""
    SLEEP = "sleep"
    """The page sleeps: nothing is sent or read, the connection stays."""
    OFF = "off"
    """The headset is taken off: no body is sent, all else goes on."""
    BLACK_HOLE = "black_hole"
    """Nothing gets through; afterwards the headset connects again with its token."""


@dataclass(frozen=True, slots=True)
class HeadsetFaultRange:
    """Range of a fault's size, and how long it lasts where nothing is said, seconds."""

    unit: str
    usual: float
    high: float
    usual_for_s: float


RANGES = {
    HeadsetFaultKind.LOSS: HeadsetFaultRange("", 0.05, 1.0, math.inf),
    HeadsetFaultKind.JITTER: HeadsetFaultRange("s", 0.02, 0.5, math.inf),
    HeadsetFaultKind.SLEEP: HeadsetFaultRange("", 1.0, 1.0, 5.0),
    HeadsetFaultKind.OFF: HeadsetFaultRange("", 1.0, 1.0, 5.0),
    HeadsetFaultKind.BLACK_HOLE: HeadsetFaultRange("", 1.0, 1.0, 20.0),
}
"""Sizes: shares and seconds that a home Wi-Fi shows as usual ones, its worst as limits."""

LONGEST_S = 24 * 3600.0
"""Latest begin of a fault, seconds: a day."""

MAX_FAULTS = 100
"""Faults of one headset."""

KEYS = ("at", "for", "size")
"""Keys of a fault: begin and duration in seconds, and its size."""


class HeadsetFaultError(ValueError):
    """A fault that there is not: its value, and what is wanted."""


@dataclass(frozen=True, slots=True)
class HeadsetFault:
    """One fault.

    Attributes:
        kind: of `HeadsetFaultKind`.
        at_s: begin, seconds from the person's joining.
        for_s: duration.
        size: in the unit of its `RANGES`.

    Raises:
        HeadsetFaultError: a value is out of range.
    """

    kind: HeadsetFaultKind
    at_s: float
    for_s: float
    size: float

    def __post_init__(self) -> None:
        high, unit = RANGES[self.kind].high, RANGES[self.kind].unit
        if not 0.0 <= self.at_s <= LONGEST_S:
            raise HeadsetFaultError(
                f"fault {self.kind}: at={self.at_s:g}, wanted 0 to {LONGEST_S:g} s"
            )
        if not self.for_s > 0.0:
            raise HeadsetFaultError(f"fault {self.kind}: for={self.for_s:g}, wanted more than 0 s")
        if not 0.0 <= self.size <= high:
            raise HeadsetFaultError(
                f"fault {self.kind}: size={self.size:g}, wanted 0 to {high:g} {unit}".rstrip()
            )

    def holds(self, t_s: float) -> bool:
        """Whether it is there."""
        return self.at_s <= t_s < self.at_s + self.for_s


@dataclass(frozen=True, slots=True)
class HeadsetState:
    """Faults that are there at one moment; sizes as in `RANGES`, 0 where there is none."""

    loss: float = 0.0
    jitter_s: float = 0.0
    is_asleep: bool = False
    is_off: bool = False
    is_cut: bool = False

    @property
    def shows_body(self) -> bool:
        """Whether bodies are sent."""
        return not (self.is_asleep or self.is_off or self.is_cut)


def headset_state(faults: Iterable[HeadsetFault], t_s: float) -> HeadsetState:
    """Return the faults that are there, seconds from the person's joining."""
    there = [fault for fault in faults if fault.holds(t_s)]
    kinds = {fault.kind for fault in there}

    def largest(kind: HeadsetFaultKind) -> float:
        return max((fault.size for fault in there if fault.kind is kind), default=0.0)

    return HeadsetState(
        largest(HeadsetFaultKind.LOSS),
        largest(HeadsetFaultKind.JITTER),
        HeadsetFaultKind.SLEEP in kinds,
        HeadsetFaultKind.OFF in kinds,
        HeadsetFaultKind.BLACK_HOLE in kinds,
    )


def read_headset_faults(texts: Iterable[str]) -> tuple[HeadsetFault, ...]:
    """Return the faults of `KIND:at=SECONDS,for=SECONDS,size=VALUE`; all but the kind is optional.

    Raises:
        HeadsetFaultError: one is none, or there are too many.
    """
    faults = tuple(_read(text) for text in texts)
    if len(faults) > MAX_FAULTS:
        raise HeadsetFaultError(f"faults: {len(faults)}, wanted at most {MAX_FAULTS}")
    return faults


def _read(text: str) -> HeadsetFault:
    name, _, rest = text.strip().partition(":")
    try:
        kind = HeadsetFaultKind(name.strip())
    except ValueError:
        kinds = ", ".join(HeadsetFaultKind)
        raise HeadsetFaultError(f"fault {text!r}: kind {name!r}, wanted one of {kinds}") from None
    values: dict[str, float] = {}
    for part in filter(None, (part.strip() for part in rest.split(","))):
        key, _, value = (word.strip() for word in part.partition("="))
        if key not in KEYS:
            wanted = ", ".join(f"{known}=…" for known in KEYS)
            raise HeadsetFaultError(f"fault {text!r}: {part!r}, wanted {wanted}")
        try:
            values[key] = float(value)
        except ValueError:
            raise HeadsetFaultError(f"fault {text!r}: {part!r}, wanted a number") from None
    usual = RANGES[kind]
    return HeadsetFault(
        kind,
        values.get("at", 0.0),
        values.get("for", usual.usual_for_s),
        values.get("size", usual.usual),
    )
