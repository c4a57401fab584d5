"""Schedule of the periodic work that no single frame needs.

Resting objects are measured in turn, and the background is learned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

TURN_PERIOD = 4
"""Frames between two measurements of resting objects, one object at a time. Chosen on the rooms lab
and desk."""

TURN_PHASE = 0
"""First frame of that period."""


LEARN_PERIOD = 4
"""Frames between two updates of the background, a band of one lens at a time. Chosen on the rooms
lab and desk."""

LEARN_PHASE = 2
"""First frame of that period: halfway between measurements, so that no frame does both."""


DUE = ((TURN_PERIOD, TURN_PHASE), (LEARN_PERIOD, LEARN_PHASE))
"""(period, phase) of all periodic work."""


LATE_FRAMES = 30
"""Frames that count as late after a frame of the stream was dropped. Chosen on the rooms lab and
desk."""


MAX_DEFERRED_FRAMES = 4
"""Frames by which late frames defer periodic work at most, so that it is done even if all frames
are late."""


@dataclass(frozen=True, slots=True)
class Schedule:
    """The periodic work of one frame.

    Attributes:
        seq: number of the frame in its stream.
        pictures: frames of the stream since the last processed one; more than 1 if some were
            dropped.
        beat: counter from which the periodic work follows; 0 at the first frame.
        deferred: consecutive frames, this one included, that deferred periodic work.
        late_until: number in the stream of the last frame that counts as late.
    """

    seq: int
    pictures: int = 1
    beat: int = 0
    deferred: int = 0
    late_until: int = -1

    def following(self, seq: int) -> Schedule:
        """The schedule of the next processed frame."""
        pictures = max(seq - self.seq, 1)
        late_until = seq + LATE_FRAMES if pictures > 1 else self.late_until
        beat = self.beat if self.deferred else self.beat + 1
        following = Schedule(seq, pictures, beat, 0, late_until)
        if seq <= late_until and not following.is_free and self.deferred < MAX_DEFERRED_FRAMES:
            return replace(following, deferred=self.deferred + 1)
        return following

    @property
    def is_first(self) -> bool:
        """Whether this is the first processed frame."""
        return self.beat == 0

    @property
    def is_free(self) -> bool:
        """Whether no periodic work falls on this frame."""
        return all((self.beat - phase) % period for period, phase in DUE)

    @property
    def measures(self) -> int | None:
        """Running number of the resting object to measure; None if none is due."""
        return self._turn(TURN_PERIOD, TURN_PHASE)

    @property
    def learns(self) -> int | None:
        """Running number of the background band to learn, modulo the bands; None if none is due."""
        return self._turn(LEARN_PERIOD, LEARN_PHASE)

    def _turn(self, period: int, phase: int) -> int | None:
        is_due = (self.beat - phase) % period == 0 and not self.deferred
        return self.beat // period if is_due else None
