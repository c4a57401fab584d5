"""The camera's exact picture at any instant of a recording: decoded from the keyframe before it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.packet_pictures import LensPictures
from devices.packet_runs import RunError
from devices.recording import RecordingReader
from studio.app.timeline.pictures.decoding import InRuns, OneByOne, Shown
from studio.app.timeline.recorded.index import Packets

EARLY_PACKETS = 4
"""From so many packets on that have to be decoded, another picture is given first, chosen: each
takes about 20 ms in a large picture."""


def ignore(_picture: PictureAt) -> None:
    """Nobody wants what comes early."""


@dataclass(frozen=True, slots=True, eq=False)
class PictureAt:
    """The front lens's picture at an instant.

    Attributes:
        asked_ns: the time that was asked for.
        t_ns: when it was taken.
        picture: (H, W, 3) RGB.
        lenses: all lenses' pictures at that time, the front one first; none of a reduced picture.
        is_exact: whether it is the newest picture at the time that was asked for.
    """

    asked_ns: int
    t_ns: int
    picture: NDArray[np.uint8]
    lenses: LensPictures = ()
    is_exact: bool = True

    @property
    def is_full(self) -> bool:
        """Whether it has all its pixels."""
        return bool(self.lenses)


class PictureReader:
    """Decodes single pictures of a recording, from the keyframe before each; one thread's.

    Going on from a picture takes only the packets in between. Several packets are decoded at once;
    where that cannot be done, as in damaged ones, one after the other.

    Args:
        path: the recording.
        packets: where its pictures are.
        threads: pictures that are decoded at once; None for as many as suit the machine.

    Raises:
        RecordingError, OSError: as `RecordingReader`.
    """

    def __init__(self, path: Path, packets: Packets, *, threads: int | None = None) -> None:
        self._reader = RecordingReader(path)
        self._packets = packets
        self._run = InRuns(self._reader, packets, threads=threads)
        self._single = OneByOne(self._reader, packets)
        self._unsuited = -1
        """Keyframe of the group of pictures that could not be decoded in a run last."""
        self._last = -1
        self._shown: PictureAt | None = None

    def close(self) -> None:
        """Close the file."""
        self._run.leave()
        self._reader.close()

    def packet_at(self, t_ns: int) -> int | None:
        """Number of the packet whose picture is shown at a time; None if there is none."""
        needed = self._packets.needed(t_ns)
        return None if needed is None else needed[1]

    def left(self, t_ns: int) -> int:
        """Packets that have to be decoded for the picture at a time."""
        needed = self._packets.needed(t_ns)
        if needed is None or (self._shown is not None and needed[1] == self._last):
            return 0
        return (self._single if needed[0] == self._unsuited else self._run).left(*needed)

    def is_soon(self, t_ns: int) -> bool:
        """Whether the picture at a time follows the last one closely, as while playing."""
        needed = self._packets.needed(t_ns)
        if needed is None or (self._shown is not None and needed[1] == self._last):
            return True
        decoder = self._single if needed[0] == self._unsuited else self._run
        return decoder.goes_on(*needed) and decoder.left(*needed) <= EARLY_PACKETS

    def picture_at(
        self,
        t_ns: int,
        *,
        is_stale: Callable[[], bool] = lambda: False,
        early: Callable[[PictureAt], None] = ignore,
    ) -> PictureAt | None:
        """The newest picture at or before a time; None if there is none or it became stale.

        Args:
            t_ns: the time.
            is_stale: asked between packets; once it says yes, the rest is not decoded.
            early: is given the keyframe's picture where the one asked for takes long.

        Raises:
            RecordingError, ValueError: the recording is damaged there.
        """
        needed = self._packets.needed(t_ns)
        if needed is None:
            return None
        if self._shown is not None and needed[1] == self._last:
            return replace(self._shown, asked_ns=t_ns)
        self._shown = None

        def keyframe(found: Shown) -> None:
            early(PictureAt(t_ns, found.t_ns, found.lenses[0], found.lenses, is_exact=False))

        found = self._decoded(
            *needed, is_stale, keyframe if self.left(t_ns) > EARLY_PACKETS else None
        )
        if found is not None:
            self._last = needed[1]
            self._shown = PictureAt(t_ns, found.t_ns, found.lenses[0], found.lenses)
        return self._shown

    def _decoded(
        self,
        first: int,
        last: int,
        is_stale: Callable[[], bool],
        keyframe: Callable[[Shown], None] | None,
    ) -> Shown | None:
        if first != self._unsuited:
            try:
                return self._run.decoded(first, last, is_stale=is_stale, keyframe=keyframe)
            except RunError:
                self._unsuited = first
        return self._single.decoded(first, last, is_stale=is_stale, keyframe=keyframe)
