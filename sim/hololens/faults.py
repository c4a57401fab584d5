"""Faults of a simulated HoloLens and of the way to it: their kinds, as text, and at a moment."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class HoloLensFaultKind(StrEnum):
    """Kinds of faults."""

    DELAY = "delay"
    """Everything is sent later."""
    JITTER = "jitter"
    """Everything is sent later, by chance; what is asked arrives later, too."""
    DRIFT = "drift"
    """The headset's clock runs too fast, from its beginning on."""
    DROP = "drop"
    """Packets of streams are left out by chance."""
    STALL = "stall"
    """Nothing is sent, connections stay."""
    HANG_UP = "hang_up"
    """All connections are closed, and none is taken meanwhile."""
    BROKEN = "broken"
    """Pictures have wrong bytes by chance."""
    LOST = "lost"
    """The headset does not know where it is: no poses, no head, no hands."""
    SHIFT = "shift"
    """The headset's world jumps to the side, for good."""
    SLIDE = "slide"
    """The headset's world slides to the side while it lasts, and stays where it is then."""
    BOX = "box"
    """A box as large as that stands in the middle of the room, in the headset's mesh."""


@dataclass(frozen=True, slots=True)
class HoloLensFaultRange:
    """Range of a fault's size, and how long it lasts where nothing is said, seconds."""

    unit: str
    usual: float
    low: float
    high: float
    usual_for_s: float


RANGES = {
    HoloLensFaultKind.DELAY: HoloLensFaultRange("s", 0.05, 0.0, 5.0, math.inf),
    HoloLensFaultKind.JITTER: HoloLensFaultRange("s", 0.005, 0.0, 0.5, math.inf),
    HoloLensFaultKind.DRIFT: HoloLensFaultRange("ppm", 50.0, -500.0, 500.0, math.inf),
    HoloLensFaultKind.DROP: HoloLensFaultRange("", 0.05, 0.0, 1.0, math.inf),
    HoloLensFaultKind.STALL: HoloLensFaultRange("", 1.0, 1.0, 1.0, 2.0),
    HoloLensFaultKind.HANG_UP: HoloLensFaultRange("", 1.0, 1.0, 1.0, 1.0),
    HoloLensFaultKind.BROKEN: HoloLensFaultRange("", 0.05, 0.0, 1.0, math.inf),
    HoloLensFaultKind.LOST: HoloLensFaultRange("", 1.0, 1.0, 1.0, 2.0),
    HoloLensFaultKind.SHIFT: HoloLensFaultRange("m", 0.1, -5.0, 5.0, math.inf),
    HoloLensFaultKind.SLIDE: HoloLensFaultRange("m/s", 0.001, -0.1, 0.1, math.inf),
    HoloLensFaultKind.BOX: HoloLensFaultRange("m", 0.4, 0.05, 3.0, 10.0),
}
"""Sizes: what a home Wi-Fi and a headset show as usual ones, and limits that still make sense."""

LONGEST_S = 24 * 3600.0
"""Latest begin of a fault, seconds: a day."""

MAX_FAULTS = 100
"""Faults of one headset."""

KEYS = ("at", "for", "size")
"""Keys of a fault: begin and duration in seconds, and its size."""


class HoloLensFaultError(ValueError):
    """A fault that there is not: its value, and what is wanted."""


@dataclass(frozen=True, slots=True)
class HoloLensFault:
    """One fault.

    Attributes:
        kind: of `HoloLensFaultKind`.
        at_s: begin, seconds from the simulator's.
        for_s: duration.
        size: in the unit of its `RANGES`.

    Raises:
        HoloLensFaultError: a value is out of range.
    """

    kind: HoloLensFaultKind
    at_s: float
    for_s: float
    size: float

    def __post_init__(self) -> None:
        of = RANGES[self.kind]
        if not 0.0 <= self.at_s <= LONGEST_S:
            raise HoloLensFaultError(
                f"fault {self.kind}: at={self.at_s:g}, wanted 0 to {LONGEST_S:g} s"
            )
        if not self.for_s > 0.0:
            raise HoloLensFaultError(f"fault {self.kind}: for={self.for_s:g}, wanted more than 0 s")
        if not of.low <= self.size <= of.high:
            raise HoloLensFaultError(
                f"fault {self.kind}: size={self.size:g}, wanted {of.low:g} to {of.high:g} {of.unit}"
            )

    def holds(self, t_s: float) -> bool:
        """Whether it is there."""
        return self.at_s <= t_s < self.at_s + self.for_s


@dataclass(frozen=True, slots=True)
class HoloLensFaults:
    """All faults of one headset.

    Attributes:
        faults: in any order.
    """

    faults: tuple[HoloLensFault, ...] = ()

    def size_of(self, kind: HoloLensFaultKind, t_s: float) -> float:
        """Return the sum of the sizes of a kind at a moment; 0 where there is none."""
        return sum(f.size for f in self.faults if f.kind is kind and f.holds(t_s))

    def is_there(self, kind: HoloLensFaultKind, t_s: float) -> bool:
        """Whether there is one of a kind at a moment."""
        return any(f.kind is kind and f.holds(t_s) for f in self.faults)

    @property
    def drift_ppm(self) -> float:
        """How much too fast the headset's clock runs, whenever it is asked."""
        return sum(f.size for f in self.faults if f.kind is HoloLensFaultKind.DRIFT)

    def shift_m(self, t_s: float) -> float:
        """Return how far the headset's world is from where it began."""
        moved = 0.0
        for fault in self.faults:
            since_s = t_s - fault.at_s
            if fault.kind is HoloLensFaultKind.SHIFT and since_s >= 0:
                moved += fault.size
            if fault.kind is HoloLensFaultKind.SLIDE and since_s >= 0:
                moved += fault.size * min(since_s, fault.for_s)
        return moved


def read_hololens_faults(texts: Iterable[str]) -> HoloLensFaults:
    """Return the faults of texts `KIND:at=SECONDS,for=SECONDS,size=VALUE`.

    Raises:
        HoloLensFaultError: one is none, or there are too many.
    """
    found = tuple(_read(text) for text in texts)
    if len(found) > MAX_FAULTS:
        raise HoloLensFaultError(f"{len(found)} faults, limit {MAX_FAULTS}")
    return HoloLensFaults(found)


def _read(text: str) -> HoloLensFault:
    name, _, rest = text.strip().partition(":")
    try:
        kind = HoloLensFaultKind(name.strip())
    except ValueError:
        raise HoloLensFaultError(
            f"fault {text!r}: kind {name!r}, wanted one of {', '.join(HoloLensFaultKind)}"
        ) from None
    of = RANGES[kind]
    values = {"at": 0.0, "for": of.usual_for_s, "size": of.usual}
    for part in filter(None, (part.strip() for part in rest.split(","))):
        key, _, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if key.strip() not in KEYS or math.isnan(number):
            wanted = ", ".join(f"{each}=NUMBER" for each in KEYS)
            raise HoloLensFaultError(f"fault {text!r}: {part!r}, wanted {wanted}")
        values[key.strip()] = number
    return HoloLensFault(kind, values["at"], values["for"], values["size"])
