"""Bytes as readers take them, from memory or a connection, and the error of bytes that are none."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

Take = Callable[[int], bytes]
"""Returns exactly so many bytes, or raises. A reader says no number that it has not checked."""


class WireError(ValueError):
    """Bytes that no headset and no client sends; says which value was wrong, and its limit."""


class CutShortError(WireError):
    """The bytes end within a message."""


class FromMemory:
    """Bytes taken from memory, in order.

    Args:
        data: all there is.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def left(self) -> int:
        """Bytes that nobody has taken."""
        return len(self._data) - self._at

    def __call__(self, count: int) -> bytes:
        """Take so many.

        Raises:
            CutShortError: fewer are left.
        """
        if count > self.left:
            raise CutShortError(f"{count} bytes wanted at {self._at}, {self.left} left")
        taken = self._data[self._at : self._at + count]
        self._at += count
        return taken


def taken(take: Take, layout: struct.Struct) -> tuple[Any, ...]:
    """Take the values of a layout."""
    return layout.unpack(take(layout.size))


def checked_count(name: str, count: int, *, most: int) -> int:
    """Return a count that came with the bytes.

    Raises:
        WireError: it is above its limit.
    """
    if count > most:
        raise WireError(f"{name}: {count}, limit {most}")
    return count
