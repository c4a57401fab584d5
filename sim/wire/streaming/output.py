"""Interface of every protocol's end of a simulated camera."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Protocol

from sim.wire.faults import WireState
from sim.wire.streaming.events import CameraEvent, Say
from sim.wire.unit_faults import OutgoingUnit

LOOK_S = 0.02
"""How often a thread looks whether a fault has begun or ended, seconds: a picture's time at 50 a
second, so that no picture passes unseen."""

Sent = Callable[[OutgoingUnit, str], None]
"""Takes a unit that was handed to the network, and the output's name."""


@dataclass(frozen=True, slots=True)
class OutputSetting:
    """Setting that a camera gives its outputs.

    Attributes:
        now: nanoseconds from the stream's beginning.
        state: what is wrong at a time of `now`.
        say: takes events.
        sent: takes what was sent.
        random: of garbage and lost packets.
    """

    now: Callable[[], int]
    state: Callable[[int], WireState]
    say: Say
    sent: Sent
    random: Random

    def current(self) -> WireState:
        """State of the wire at this moment."""
        return self.state(self.now())

    def report(self, name: str, **values: str | int | float) -> None:
        """Say that something happened now."""
        self.say(CameraEvent(name, self.now(), values))


class Output(Protocol):
    """One protocol's end of a camera."""

    @property
    def name(self) -> str:
        """The protocol, for people."""
        ...

    @property
    def url(self) -> str:
        """URL that it streams to, or that it can be fetched at."""
        ...

    @property
    def connections(self) -> int:
        """Connections so far."""
        ...

    @property
    def sent_units(self) -> int:
        """Units handed to the network so far."""
        ...

    def put(self, unit: OutgoingUnit) -> None:
        """Take a unit; never blocks."""
        ...

    def close(self) -> None:
        """Hang up and wait for the threads."""
        ...
