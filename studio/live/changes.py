"""Changes that people make to a live session: kept for its report, tracker settings undone."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from devices.clock import Clock
from tracking.options import TrackerOptions

MAX_CHANGES = 10_000
"""Changes that are kept; the oldest go first."""


@dataclass(frozen=True, slots=True)
class Change:
    """Something that a person changed, when and in words."""

    t_ns: int
    text: str


class Changes:
    """Changes of one session; any thread.

    Args:
        clock: session time.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._kept: deque[Change] = deque(maxlen=MAX_CHANGES)
        self._options = TrackerOptions()
        self._former: deque[TrackerOptions] = deque(maxlen=MAX_CHANGES)

    @property
    def options(self) -> TrackerOptions:
        """The tracker's settings now."""
        return self._options

    def kept(self) -> tuple[Change, ...]:
        """All changes, oldest first."""
        return tuple(self._kept)

    def add(self, text: str) -> str:
        """Keep a change in words; gives the words."""
        self._kept.append(Change(self._clock.now_ns(), text))
        return text

    def adjust(self, options: TrackerOptions) -> str:
        """Other settings of the tracker; gives the change in words."""
        self._former.append(self._options)
        self._options = options
        return self.add(f"tracker: {options}")

    def undo(self) -> str:
        """The settings before the last change again; empty if there is none."""
        if not self._former:
            return ""
        self._options = self._former.pop()
        return self.add(f"tracker, undone: {self._options}")
