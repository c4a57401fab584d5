"""A film: access units with their times, what each shows, and the truth of every picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.messages import Event
from scenes.pose import Pose


@dataclass(frozen=True, slots=True, eq=False)
class PictureTruth:
    """Poses at the time a picture was taken.

    Attributes:
        t_ns: when, on the script's or the recording's clock.
        world_from_object: true pose by object id.
        visible_fraction: 0..1 by object id, over all lenses.
        world_from_rig: true pose of the camera.
        faults: size of every fault of the film that is in it, by its name.
    """

    t_ns: int
    world_from_object: Mapping[str, Pose]
    visible_fraction: Mapping[str, float]
    world_from_rig: Pose
    faults: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, slots=True)
class FilmUnit:
    """One access unit of a film.

    Attributes:
        number: counted from the first round on.
        t_ns: its time from the film's beginning.
        data: H.264 Annex B, with parameter sets at keyframes.
        keyframe: whether decoding may start here.
        shows: number of the picture it shows; pictures are numbered as they were taken.
    """

    number: int
    t_ns: int
    data: bytes
    keyframe: bool
    shows: int


@dataclass(frozen=True, slots=True)
class FilmFormat:
    """How a film's pictures are.

    Attributes:
        width_px: of the whole picture.
        height_px: likewise.
        fps: nominal pictures a second.
        layout: how the lens pictures lie in it, as a person names it; "unknown" of a video.
        bitrate: that the encoder was given, bits per second; 0 where that is not known.
    """

    width_px: int
    height_px: int
    fps: float
    layout: str
    bitrate: int = 0


class Film:
    """A stream of access units that begins and ends with the same keyframe distance.

    Played over and over, its times go on: `unit(k)` of any k >= 0 is the unit `k % len(film)`.

    Args:
        name: what it shows, for people.
        form: how its pictures are.
        data: all access units, one after the other.
        offsets: (U + 1,) int64, where each begins in `data`, and the end.
        t_ns: (U,) int64, their times from 0, growing.
        duration_ns: from the first unit's time to that of the next round's first.
        keyframes: (U,) bool.
        shows: (U,) int64, the picture that each shows.
        truth: of every picture, by its number; empty where nothing is known.
        events: what happened, with times of the pictures.

    Raises:
        ValueError: there is no unit, the first is no keyframe, or the arrays do not match.
    """

    def __init__(
        self,
        name: str,
        form: FilmFormat,
        *,
        data: bytes | memoryview,
        offsets: NDArray[np.int64],
        t_ns: NDArray[np.int64],
        duration_ns: int,
        keyframes: NDArray[np.bool_],
        shows: NDArray[np.int64],
        truth: Sequence[PictureTruth] = (),
        events: Sequence[Event] = (),
    ) -> None:
        count = len(t_ns)
        if not count or not keyframes[0]:
            raise ValueError(f"film {name!r}: {count} units, wanted some and a keyframe first")
        if (len(offsets), len(keyframes), len(shows)) != (count + 1, count, count):
            raise ValueError(
                f"film {name!r}: {count} times, {len(offsets) - 1} units, {len(keyframes)} kinds "
                f"and {len(shows)} pictures, wanted as many of each"
            )
        if np.any(np.diff(offsets) <= 0) or int(offsets[-1]) > len(data):
            raise ValueError(f"film {name!r}: its units lead beyond its {len(data)} bytes")
        if np.any(np.diff(t_ns) <= 0) or duration_ns <= int(t_ns[-1]):
            raise ValueError(f"film {name!r}: its times do not grow")
        self.name, self.form = name, form
        self.duration_ns = duration_ns
        self.truth, self.events = tuple(truth), tuple(events)
        self._data = memoryview(data)
        self._offsets, self._t_ns = offsets, t_ns
        self._keyframes, self._shows = keyframes, shows

    def __len__(self) -> int:
        return len(self._t_ns)

    @property
    def size_bytes(self) -> int:
        """All its access units."""
        return int(self._offsets[-1])

    def unit(self, number: int) -> FilmUnit:
        """Unit `number` of the film played over and over, its time going on from round to round.

        Raises:
            ValueError: the number is negative.
        """
        if number < 0:
            raise ValueError(f"film {self.name!r}: unit {number}, wanted one from 0 on")
        rounds, index = divmod(number, len(self))
        begin, end = int(self._offsets[index]), int(self._offsets[index + 1])
        return FilmUnit(
            number,
            rounds * self.duration_ns + int(self._t_ns[index]),
            bytes(self._data[begin:end]),
            bool(self._keyframes[index]),
            int(self._shows[index]),
        )

    def time_ns(self, number: int) -> int:
        """Time of `unit(number)`, without its bytes."""
        rounds, index = divmod(number, len(self))
        return rounds * self.duration_ns + int(self._t_ns[index])

    def number_at(self, t_ns: int) -> int:
        """The unit that is due last at a time from the film's beginning, at least 0."""
        rounds, rest = divmod(max(0, t_ns), self.duration_ns)
        return rounds * len(self) + int(np.searchsorted(self._t_ns, rest, side="right")) - 1

    def keyframe_before(self, number: int) -> int:
        """The last keyframe up to `unit(number)`."""
        while not self._keyframes[number % len(self)]:
            number -= 1
        return number

    def truth_of(self, shows: int) -> PictureTruth | None:
        """Truth of a picture; None where the film knows nothing."""
        return self.truth[shows] if shows < len(self.truth) else None
