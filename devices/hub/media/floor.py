"""The floor: of all who speak at the same time, those who are heard."""

from __future__ import annotations

from dataclasses import dataclass

PLACES = 6
"""Voices at the same time; chosen: nobody follows more, and what everybody gets stays bounded."""

SPEECH_DB = 60
"""Level below full scale from which it is speech, dB; chosen: a quiet room's noise is at 70."""

HOLD_NS = 400_000_000
"""Silence after which somebody no longer speaks: longer than a pause between words."""


@dataclass(slots=True)
class _Place:
    """A place: whose it is or was last, and when they spoke last."""

    index: int
    loud_ns: int


class Floor:
    """Places of those who speak, first come first served; each keeps a place until it is wanted."""

    def __init__(self) -> None:
        self._places: list[_Place | None] = [None] * PLACES

    def take(self, index: int, *, level_db: int, now_ns: int) -> int | None:
        """Return the place of somebody's moment of voice; None where it is not to be heard.

        Args:
            index: of the person.
            level_db: how far below full scale it is.
            now_ns: session time.
        """
        is_loud = level_db < SPEECH_DB
        for number, place in enumerate(self._places):
            if place is not None and place.index == index:
                if is_loud:
                    place.loud_ns = now_ns
                return number if now_ns - place.loud_ns <= HOLD_NS else None
        if not is_loud:
            return None
        number = self._free(now_ns)
        if number is not None:
            self._places[number] = _Place(index, now_ns)
        return number

    def drop(self, index: int) -> None:
        """Take somebody's place away: muted, or gone."""
        for number, place in enumerate(self._places):
            if place is not None and place.index == index:
                self._places[number] = None

    def owners(self) -> tuple[int | None, ...]:
        """Return whose voice is at each place, or was last; None where it was nobody's."""
        return tuple(None if place is None else place.index for place in self._places)

    def speaking(self, now_ns: int) -> frozenset[int]:
        """Return indices of those who speak."""
        return frozenset(
            place.index
            for place in self._places
            if place is not None and now_ns - place.loud_ns <= HOLD_NS
        )

    def _free(self, now_ns: int) -> int | None:
        """Return a place nobody has had, else the one that is silent longest; None if all speak."""
        for number, place in enumerate(self._places):
            if place is None:
                return number
        loud_ns, number = min(
            (place.loud_ns, number) for number, place in enumerate(self._places) if place
        )
        return number if now_ns - loud_ns > HOLD_NS else None
