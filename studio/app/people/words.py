"""States of the doors and of people in words and shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from studio.app.model.runs.guests import WORSE_MS, DoorState

if TYPE_CHECKING:
    from devices.hub.roles import Person

EXPIRES_SOON_S = 30.0
"""Time left of a code from which it is shown in the colour of a warning, seconds: about what it
takes to read it out and to type it."""

NETWORK_WARNING = (
    "Everybody on this network can then reach the page and try codes: after five wrong ones an "
    "address is refused for a minute. Nobody sees the room without a code. Browsers warn of the "
    "certificate until this computer's own root certificate is installed."
)
"""Consequences of opening the room to the network, said before it is done."""

STARTS = {
    DoorState.NO_SESSION: "People join a live session. Check and connect a camera first.",
    DoorState.CLOSED: "Nobody can join yet.",
    DoorState.OPENING: "The room is being opened …",
    DoorState.HERE: "Browsers on this computer can join with a code.",
    DoorState.NETWORK: "Browsers and headsets on this network can join with a code.",
}
"""Sentences of the states."""

ROLE_HINTS = {
    "local": "in the room itself: seen, heard, points, draws, puts things, makes surfaces live",
    "remote": "elsewhere: seen, heard, points, draws, puts things, makes surfaces live",
    "operator": "as remote; who operates the session does so in this window",
    "spectator": "looks on: seen, hears, and changes nothing",
}
"""Rights of the roles in a sentence."""


@dataclass(frozen=True, slots=True)
class State:
    """A state as it is shown.

    Attributes:
        kind: of the theme's colours and shapes.
        word: the state.
    """

    kind: str
    word: str


def state_of(person: Person) -> State:
    """Return how somebody is doing."""
    if not person.is_connected:
        return State("warning", "away, may come back")
    if person.is_muted:
        return State("calm", "muted")
    if person.is_speaking:
        return State("good", "speaks, has the pen" if person.has_pen else "speaks")
    if person.has_pen:
        return State("good", "has the pen")
    if person.latency_ms is None:
        return State("unknown", "just came")
    if person.latency_ms > WORSE_MS:
        return State("warning", "slow connection")
    return State("good", "here, microphone on" if person.has_microphone else "here")


def latency_words(person: Person) -> str:
    """Return the round trip to somebody; a dash where it is not known."""
    if person.latency_ms is None or not person.is_connected:
        return "–"
    return f"{person.latency_ms:.0f} ms"


def time_words(seconds: float) -> str:
    """Return how long a code can still be used."""
    if seconds <= 0.0:
        return "expired: make a new code"
    minutes, rest = divmod(int(seconds), 60)
    return f"one person, {minutes}:{rest:02d} left"


def code_words(code: str) -> str:
    """Return a code as it is read out: in two groups."""
    half = len(code) // 2
    return f"{code[:half]} {code[half:]}"


def here_words(count: int) -> str:
    """Return how many people are here."""
    if count == 0:
        return "Nobody is here yet."
    return "1 person is here" if count == 1 else f"{count} people are here"
