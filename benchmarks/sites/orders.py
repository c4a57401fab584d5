"""Orders to the processes of a simulated building, and how each says what it has used."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from devices.transport.keys import MemberRole
from devices.transport.passes import Pass, read_pass
from devices.transport.transport import Answer, Handler, Transport

OBJECTS = 12
"""Objects of a room, all of which move: as many as the lab has."""

STATE_HZ = 10.0
"""States of a room a second: the tracker's on two cores."""

STAMP_S = 90.0
"""Span of the time that an object's place tells, seconds: rooms are 100 m large."""


@dataclass(frozen=True, slots=True)
class Orders:
    """A building to be simulated.

    Attributes:
        router: host and port.
        folder: of the building's passes.
        rooms: how many, each with one site.
        clients: people at each site.
        hz: bodies a second of each.
        seconds: how long.
    """

    router: str
    folder: str
    rooms: int
    clients: int
    hz: float
    seconds: float

    def to_line(self) -> str:
        """Return them as a process reads them."""
        return json.dumps(asdict(self))

    def pass_of(self, role: MemberRole, number: int) -> Pass:
        """Return the pass of a room or site."""
        return read_pass(Path(self.folder) / "passes" / f"{role}-{name_of(number)}.pass")


def read_orders() -> Orders:
    """Return orders, which are the first line of standard input."""
    return Orders(**json.loads(sys.stdin.readline()))


def say(**fields: Any) -> None:
    """Print a line for whoever runs this process."""
    print(json.dumps(fields), flush=True)


def name_of(number: int) -> str:
    """Return the name of a room, and of its site."""
    return f"r{number}"


def stamp_now() -> float:
    """Return the time as a place in a room, metres: a second is a metre."""
    return time.monotonic() % STAMP_S


def age_s(stamp: float) -> float:
    """Return how long ago a stamp was made, seconds."""
    return (time.monotonic() - stamp) % STAMP_S


class Counted:
    """A transport that counts messages and bytes, both ways.

    Attributes:
        sent: messages.
        sent_bytes: their data.
        heard: messages.
        heard_bytes: their data.
    """

    def __init__(self, inner: Transport) -> None:
        self._inner = inner
        self.sent = self.sent_bytes = self.heard = self.heard_bytes = 0

    def put(self, key: str, data: bytes) -> None:
        """Count, and send."""
        self.sent += 1
        self.sent_bytes += len(data) + len(key)
        self._inner.put(key, data)

    def subscribe(self, pattern: str, handler: Handler) -> Any:
        """Count what is heard."""

        def hear(key: str, data: bytes) -> None:
            self.heard += 1
            self.heard_bytes += len(data) + len(key)
            handler(key, data)

        return self._inner.subscribe(pattern, hear)

    def serve(self, pattern: str, answer: Answer) -> Any:
        """Pass on."""
        return self._inner.serve(pattern, answer)

    def ask(self, key: str, question: bytes, *, answered: Any) -> None:
        """Pass on."""
        self._inner.ask(key, question, answered=answered)

    def close(self) -> None:
        """End."""
        self._inner.close()
