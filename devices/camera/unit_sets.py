"""Units of several picture tracks put together to pictures, by their order.

A camera sends one unit of each track for every picture, those of the next picture after all of
them. Where a unit was lost, the next one of a track that the picture has already begins another.
Sources of several tracks are files and connections that lose nothing; of a lossy one, a lost unit
of the track that comes first would put its pictures beside those of the next moment.
"""

from __future__ import annotations

from enum import Enum, auto


class Place(Enum):
    """Position of a unit in its picture; the only one of a single track is the `LAST`."""

    FIRST = auto()
    BETWEEN = auto()
    LAST = auto()


class UnitSets:
    """Puts units into sets, one a picture.

    Args:
        tracks: of the camera.
    """

    def __init__(self, tracks: int) -> None:
        self._tracks = tracks
        self._seen: set[int] = set()

    def place(self, track: int) -> Place:
        """Take the next unit."""
        if track in self._seen:
            self._seen.clear()
        is_first = not self._seen
        self._seen.add(track)
        if len(self._seen) == self._tracks:
            self._seen.clear()
            return Place.LAST
        return Place.FIRST if is_first else Place.BETWEEN

    def begin(self) -> None:
        """The next unit is the first of a picture."""
        self._seen.clear()
