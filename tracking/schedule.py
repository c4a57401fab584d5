"""When the tracker does what no frame needs at once.

Resting objects are measured in turn, the room is learned, the camera's own motion is looked for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

TURN_PERIOD, TURN_PHASE = 4, 0
"""Frames between two fresh measurements of resting objects, one object at a time."""

LEARN_PERIOD, LEARN_PHASE = 4, 2
"""Frames between two looks at what has become of the room, a band of a lens at a time; halfway
between the measurements of resting objects, so that no frame does both."""

WATCH_PERIOD, WATCH_PHASE = 8, 5
"""Frames between two looks at whether the camera still stands, a lens at a time; at frames that
neither learn nor measure what rests."""

DUE = (
    (TURN_PERIOD, TURN_PHASE),
    (LEARN_PERIOD, LEARN_PHASE),
    (WATCH_PERIOD, WATCH_PHASE),
)

LATE_FRAMES = 30
"""So long after a picture of the stream was dropped its frames count as late."""

MOST_DEFERRED_FRAMES = 4
"""What is due at a late frame waits for so many, and not for more: all may be late for ever."""


@dataclass(frozen=True, slots=True)
class Schedule:
    """What a frame has to do beside following what moves.

    Attributes:
        seq: the frame's number in its stream.
        pictures: of the stream since the frame before: more than one if some were dropped.
        beat: what is due, and whose turn it is, follow from it; 0 at the first frame.
        deferred: frames, this one included, that leave what is due to a later one.
        late_until: number in the stream of the last frame that counts as late.
    """

    seq: int
    pictures: int = 1
    beat: int = 0
    deferred: int = 0
    late_until: int = -1

    def following(self, seq: int) -> Schedule:
        """The rota of the next frame that is looked at."""
        pictures = max(seq - self.seq, 1)
        late_until = seq + LATE_FRAMES if pictures > 1 else self.late_until
        beat = self.beat if self.deferred else self.beat + 1
        following = Schedule(seq, pictures, beat, 0, late_until)
        if seq <= late_until and not following.is_free and self.deferred < MOST_DEFERRED_FRAMES:
            return replace(following, deferred=self.deferred + 1)
        return following

    @property
    def is_first(self) -> bool:
        """Whether nothing was looked at before."""
        return self.beat == 0

    @property
    def is_free(self) -> bool:
        """Whether nothing is due."""
        return all((self.beat - phase) % period for period, phase in DUE)

    @property
    def measures(self) -> int | None:
        """Which resting object is measured, counted on for ever; None: none is."""
        return self._turn(TURN_PERIOD, TURN_PHASE)

    @property
    def learns(self) -> int | None:
        """Which part of the room is learned, counted on for ever; None: none is."""
        return self._turn(LEARN_PERIOD, LEARN_PHASE)

    @property
    def watches(self) -> int | None:
        """Which lens is looked through for the camera's motion, counted on; None: none is."""
        return self._turn(WATCH_PERIOD, WATCH_PHASE)

    def _turn(self, period: int, phase: int) -> int | None:
        is_due = (self.beat - phase) % period == 0 and not self.deferred
        return self.beat // period if is_due else None
