"""Figures of simulated people, counted together."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

import numpy as np

BIN_MS = 0.05
"""Width of a bin, chosen: a hundredth of the smallest figure that is asked for, 5 ms."""

BINS = 200_000
"""Bins: up to ten seconds; what took longer is in the last."""


class Delays:
    """Delays so far."""

    def __init__(self) -> None:
        self._counts = array("Q", bytes(8 * BINS))
        self.count = 0

    def add(self, delay_ms: float) -> None:
        """Take one; below zero, which clocks of two machines can give, counts as zero."""
        self._counts[min(max(int(delay_ms / BIN_MS), 0), BINS - 1)] += 1
        self.count += 1

    def percentile(self, share: float) -> float | None:
        """Return the delay, ms, that so many percent do not exceed; None before the first."""
        if not self.count:
            return None
        reached = np.cumsum(np.frombuffer(self._counts, dtype=np.uint64))
        place = int(np.searchsorted(reached, max(share / 100.0 * self.count, 1.0)))
        return (place + 0.5) * BIN_MS


@dataclass(slots=True)
class Tally:
    """Figures of all people of one process.

    Attributes:
        sent: bodies.
        left_out: bodies that a fault held back.
        received: bodies of others.
        states: of the room.
        log: entries of what people drew.
        done, refused: answers to operations.
        unreadable: messages that were none.
        spoken, heard: moments of voice that were sent, and of others that came.
        voice: delays from a moment's sending to its arrival; over the WebSocket alone.
        connections: welcomes.
        joins_s: from opening the page to the welcome and the thinned room, per person.
        wholes_s: from opening the page to the last file of the room, per person; none without one.
        downloaded_bytes: of rooms.
        returns_s: from a network's return to the welcome.
        hand: delays from a body's sending to its arrival at another person.
        state: delays from a picture's arrival in the studio to its state.
        indices: of the people of this process, whose bodies are on its clock.
        failures: why people have left before their time.
    """

    sent: int = 0
    left_out: int = 0
    received: int = 0
    states: int = 0
    log: int = 0
    done: int = 0
    refused: int = 0
    unreadable: int = 0
    spoken: int = 0
    heard: int = 0
    voice: Delays = field(default_factory=Delays)
    connections: int = 0
    joins_s: list[float] = field(default_factory=list[float])
    wholes_s: list[float] = field(default_factory=list[float])
    downloaded_bytes: int = 0
    returns_s: list[float] = field(default_factory=list[float])
    hand: Delays = field(default_factory=Delays)
    state: Delays = field(default_factory=Delays)
    indices: set[int] = field(default_factory=set[int])
    failures: list[str] = field(default_factory=list[str])
