"""The studio's log for its user, line by line, bounded."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Literal

Level = Literal["info", "warning", "error"]

LINES = 5000
"""Lines that are kept: some hours of a session with one warning a second."""


@dataclass(frozen=True, slots=True)
class LogLine:
    """One line.

    Attributes:
        t_ns: wall clock, ns since 1970.
        level: how much it matters.
        text: one sentence: what, where, and what to do.
    """

    t_ns: int
    level: Level
    text: str


class Log:
    """The last `LINES` lines."""

    def __init__(self) -> None:
        self._lines: deque[LogLine] = deque(maxlen=LINES)
        self.count = 0
        """Lines that ever came."""

    def add(self, line: LogLine) -> None:
        """Add a line; the oldest goes when there are too many."""
        self._lines.append(line)
        self.count += 1

    def lines(self, level: Level = "info") -> list[LogLine]:
        """Lines of this level and above, oldest first."""
        order = ("info", "warning", "error")
        least = order.index(level)
        return [line for line in self._lines if order.index(line.level) >= least]
