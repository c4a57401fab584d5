"""How finely the window draws: coarse while the viewer moves, everything once they rest."""

from __future__ import annotations

from dataclasses import dataclass

FRAME_NS = 33_000_000
"""A picture of a moving view that takes longer is drawn coarser the next time."""

REST_NS = 150_000_000
"""So long after the last move the view counts as resting."""

FORGET = 0.98
"""Factor of an unused measurement per picture, so that finer grades are tried again."""


@dataclass(frozen=True, slots=True)
class Grade:
    """How much of a picture is drawn.

    Attributes:
        scale: of its width and height.
        thinned: whether the room is drawn with fewer splats.
    """

    scale: float
    thinned: bool


FULL = Grade(1.0, thinned=False)
GRADES = (FULL, Grade(0.5, thinned=False), Grade(0.5, thinned=True))
"""Finest first."""


class Pacing:
    """Chooses the grade of each picture from how long earlier ones took.

    Moving views get the finest grade expected to take at most `FRAME_NS`, or the coarsest; resting
    views are drawn in full. It reads no clock: the caller says what time it is.
    """

    def __init__(self) -> None:
        self._expected_ns: dict[Grade, float] = dict.fromkeys(GRADES, 0.0)
        self._moved_ns: int | None = None
        self._shown = FULL

    def moved(self, now_ns: int) -> None:
        """The viewer has moved."""
        self._moved_ns = now_ns

    def choose(self, now_ns: int) -> Grade:
        """How to draw the next picture."""
        if not self._is_moving(now_ns):
            return FULL
        affordable = (grade for grade in GRADES if self._expected_ns[grade] <= FRAME_NS)
        return next(affordable, GRADES[-1])

    def drew(self, grade: Grade, took_ns: int) -> None:
        """A picture of that grade was drawn and is shown."""
        expected = {known: FORGET * ns for known, ns in self._expected_ns.items()}
        expected[grade] = float(took_ns)
        self._expected_ns = expected
        self._shown = grade

    def refine_after_s(self, now_ns: int) -> float | None:
        """Seconds until what is shown should be drawn in full; None if it already is."""
        if self._shown == FULL or self._moved_ns is None:
            return None
        return max(0.0, (self._moved_ns + REST_NS - now_ns) / 1e9)

    def _is_moving(self, now_ns: int) -> bool:
        return self._moved_ns is not None and now_ns - self._moved_ns < REST_NS
