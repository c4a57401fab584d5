"""What every source of data looks like to the session: real, simulated or recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from devices.clock import Clock
from devices.messages import EncodedFrame, Event, Frame, PoseSample

Message = Frame | EncodedFrame | PoseSample | Event
"""What an adapter can emit."""

Sink = Callable[[Message], None]
"""Where an adapter puts its messages; called on the adapter's own thread."""


@dataclass(frozen=True, slots=True)
class DeviceStatus:
    """How a device is doing.

    Attributes:
        name: shown to people.
        running: between start and the end of its data.
        frames: pictures emitted so far.
        dropped: pictures lost on the way in.
        error: what stopped it, in one line, or empty.
    """

    name: str
    running: bool
    frames: int
    dropped: int
    error: str = ""


class Device(Protocol):
    """A source of messages."""

    def start(self, sink: Sink, clock: Clock) -> None:
        """Begin to emit messages into `sink`, paced by `clock`. Returns when emitting has begun.

        Raises:
            ValueError: it is running already, or its data cannot be read.
        """
        ...

    def stop(self) -> None:
        """Stop and wait until nothing more is emitted. Harmless when stopped already."""
        ...

    def status(self) -> DeviceStatus:
        """How it is doing now."""
        ...
