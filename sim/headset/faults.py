"""Faults between a headset and the hub: their kinds, as text, and which are there at a moment."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from sim.timed_fault import FaultRange, TimedFault, read_timed_faults


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


RANGES = {
    HeadsetFaultKind.LOSS: FaultRange("", 0.05, 0.0, 1.0, math.inf),
    HeadsetFaultKind.JITTER: FaultRange("s", 0.02, 0.0, 0.5, math.inf),
    HeadsetFaultKind.SLEEP: FaultRange("", 1.0, 0.0, 1.0, 5.0),
    HeadsetFaultKind.OFF: FaultRange("", 1.0, 0.0, 1.0, 5.0),
    HeadsetFaultKind.BLACK_HOLE: FaultRange("", 1.0, 0.0, 1.0, 20.0),
}
"""Sizes: shares and seconds that a home Wi-Fi shows as usual ones, its worst as limits."""

MAX_FAULTS = 100
"""Faults of one headset."""


@dataclass(frozen=True, slots=True)
class HeadsetFault(TimedFault):
    """One fault; it begins so many seconds from the person's joining."""

    ranges = RANGES

    kind: HeadsetFaultKind


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
        FaultError: one is none, or there are too many.
    """
    return read_timed_faults(HeadsetFault, texts, most=MAX_FAULTS)
