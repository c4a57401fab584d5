"""Schedule of a frame: the periodic work that no single frame needs, and its order.

Resting objects are measured in turn, and the background is learned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from devices.messages import Frame
from scenes.state import TrackState
from tracking.background.learning import Band, Care, band_of, whole_lens
from tracking.follow.track import Track
from tracking.model.object_model import TrackModel

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


def bands_to_learn(
    schedule: Schedule, frame: Frame, tracks: Mapping[str, Track], *, is_seen_anew: bool
) -> Sequence[Band]:
    """Bands of the background to learn after the objects are measured.

    Args:
        schedule: of this frame.
        frame: this frame.
        tracks: after it.
        is_seen_anew: whether the camera was located in it: all bands then, unless an object is
            lost, which may be anywhere.
    """
    heights = [lens.height_px for lens in frame.rig.lenses]
    if is_seen_anew and not _misses_any(tracks):
        return [whole_lens(index, height_px) for index, height_px in enumerate(heights)]
    return [] if schedule.learns is None else [band_of(schedule.learns, heights)]


def _misses_any(tracks: Mapping[str, Track]) -> bool:
    """Whether an object is lost."""
    return any(track.state is TrackState.LOST for track in tracks.values())


def care_beside(tracks: Mapping[str, Track], *, is_first: bool) -> Care:
    """The care with which the background is learned.

    What is hidden may have gone, and stand elsewhere. From a single picture, shadows of the room
    cannot be distinguished from those of objects that will move.
    """
    is_hidden = any(
        track.visible_fraction == 0 or track.state is TrackState.OCCLUDED
        for track in tracks.values()
    )
    if is_hidden or _misses_any(tracks):
        return Care.WARY
    return Care.CAUTIOUS if is_first else Care.LITTLE


def most_certain_first(
    models: Sequence[TrackModel], tracks: Mapping[str, Track]
) -> list[TrackModel]:
    """Resting objects, moving ones, lost ones: each is compared with settled neighbours."""
    order = {
        TrackState.STATIC: 0,
        TrackState.TRACKED: 1,
        TrackState.OCCLUDED: 2,
        TrackState.LOST: 3,
    }
    return sorted(models, key=lambda m: order[tracks[m.object_id].state])
