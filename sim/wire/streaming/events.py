"""Events that a simulated camera reports while it streams."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CameraEvent:
    """Something that happened.

    Attributes:
        name: "connected", "disconnected", "refused", "fault_begins", "fault_ends", "ended".
        t_ns: when, from the stream's beginning.
        values: what belongs to it, by name: texts and numbers.
    """

    name: str
    t_ns: int
    values: Mapping[str, str | int | float]


Say = Callable[[CameraEvent], None]
"""Takes an event on whichever thread it happens; must not block."""
