"""Figures of simulated people, counted together."""

from __future__ import annotations

from dataclasses import dataclass, field

from sim.headset.delays import Delays


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
