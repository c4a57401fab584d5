"""Whose turn it is to be drawn, and how long the thread that draws rests after it."""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")

SHARE = 1 / 3
"""Of the time that drawing all small pictures takes at most, whatever their number. Measured with
two people walking through 300 k splats on two cores, other work beside it: at 1/5 the view in the
middle is as fast as without any and two small pictures come 4.0 times a second each; at 1/3 it
loses 17 % (38.6 to 32.2 pictures/s) and they come 7.0 times (`insets` in
`benchmarks/studio/child.py`)."""


class Turns(Generic[T]):
    """The latest request of each key; the one that was drawn longest ago has its turn."""

    def __init__(self) -> None:
        self._wanted: dict[str, T] = {}
        self._drawn: list[str] = []

    def ask(self, key: str, value: T) -> None:
        """Replace what was asked for by that key."""
        self._wanted[key] = value

    def forget(self, key: str) -> None:
        """The key wants nothing more."""
        self._wanted.pop(key, None)
        if key in self._drawn:
            self._drawn.remove(key)

    def next(self) -> tuple[str, T] | None:
        """Key and request whose turn it is, which are taken; None if nothing was asked for."""
        if not self._wanted:
            return None
        key = min(self._wanted, key=self._place)
        if key in self._drawn:
            self._drawn.remove(key)
        self._drawn.append(key)
        return key, self._wanted.pop(key)

    def _place(self, key: str) -> int:
        """Behind how many others it was drawn: never drawn comes first."""
        return self._drawn.index(key) if key in self._drawn else -1


def rest_s(took_s: float, share: float = SHARE) -> float:
    """How long to rest after a picture, so that drawing takes no more than a share of the time."""
    return took_s * (1.0 / share - 1.0)
