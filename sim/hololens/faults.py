"""Faults of a simulated HoloLens and of the way to it: their kinds, as text, and at a moment."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from sim.timed_fault import FaultRange, TimedFault, read_timed_faults


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


RANGES = {
    HoloLensFaultKind.DELAY: FaultRange("s", 0.05, 0.0, 5.0, math.inf),
    HoloLensFaultKind.JITTER: FaultRange("s", 0.005, 0.0, 0.5, math.inf),
    HoloLensFaultKind.DRIFT: FaultRange("ppm", 50.0, -500.0, 500.0, math.inf),
    HoloLensFaultKind.DROP: FaultRange("", 0.05, 0.0, 1.0, math.inf),
    HoloLensFaultKind.STALL: FaultRange("", 1.0, 1.0, 1.0, 2.0),
    HoloLensFaultKind.HANG_UP: FaultRange("", 1.0, 1.0, 1.0, 1.0),
    HoloLensFaultKind.BROKEN: FaultRange("", 0.05, 0.0, 1.0, math.inf),
    HoloLensFaultKind.LOST: FaultRange("", 1.0, 1.0, 1.0, 2.0),
    HoloLensFaultKind.SHIFT: FaultRange("m", 0.1, -5.0, 5.0, math.inf),
    HoloLensFaultKind.SLIDE: FaultRange("m/s", 0.001, -0.1, 0.1, math.inf),
    HoloLensFaultKind.BOX: FaultRange("m", 0.4, 0.05, 3.0, 10.0),
}
"""Sizes: what a home Wi-Fi and a headset show as usual ones, and limits that still make sense."""

MAX_FAULTS = 100
"""Faults of one headset."""


@dataclass(frozen=True, slots=True)
class HoloLensFault(TimedFault):
    """One fault; it begins so many seconds from the simulator's beginning."""

    ranges = RANGES

    kind: HoloLensFaultKind


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
        FaultError: one is none, or there are too many.
    """
    return HoloLensFaults(read_timed_faults(HoloLensFault, texts, most=MAX_FAULTS))
