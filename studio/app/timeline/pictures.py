"""The camera's picture at any instant of a recording, decoded on a thread."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.messages import EncodedFrame
from devices.packet_pictures import PacketPictures
from devices.recording import RecordingReader
from devices.streams import Slot, StreamClosedError
from scenes.package import ScenePackage
from studio.app.timeline.index import Packets, RecordingIndex
from studio.app.timeline.live_pictures import LiveReplay

if TYPE_CHECKING:
    from studio.view.surface_drawing import LivePicture

EARLY_PACKETS = 4
"""From so many packets after a keyframe on, the keyframe's own picture is given first, chosen: each
takes about 20 ms in a large picture."""


def _ignore(_picture: PictureAt) -> None:
    """Nobody wants what comes early."""


@dataclass(frozen=True, slots=True, eq=False)
class PictureAt:
    """The front lens's picture at an instant.

    Attributes:
        asked_ns: the time that was asked for.
        t_ns: when it was taken.
        picture: (H, W, 3) RGB.
        lenses: all lenses' pictures at that time, the front one first.
    """

    asked_ns: int
    t_ns: int
    picture: NDArray[np.uint8]
    lenses: tuple[NDArray[np.uint8], ...]


class PictureReader:
    """Decodes single pictures of a recording, from the keyframe before each; one thread's.

    Going on within the same group of pictures takes only the packets in between.

    Args:
        path: the recording.
        packets: where its pictures are.

    Raises:
        RecordingError, OSError: as `RecordingReader`.
    """

    def __init__(self, path: Path, packets: Packets) -> None:
        self._reader = RecordingReader(path)
        self._packets = packets
        self._decoder = PacketPictures(self._reader.session)
        self._first = self._done = -1
        """Packets that the decoder has taken: the keyframe and the last."""
        self._shown: PictureAt | None = None

    def close(self) -> None:
        """Close the file."""
        self._reader.close()

    def picture_at(
        self,
        t_ns: int,
        *,
        is_stale: Callable[[], bool] = lambda: False,
        early: Callable[[PictureAt], None] = _ignore,
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
        first, last = needed
        if self._shown is not None and (first, last) == (self._first, self._done):
            return replace(self._shown, asked_ns=t_ns)
        if first != self._first or last <= self._done:
            self._decoder = PacketPictures(self._reader.session)
            self._first, self._done = first, first - 1
        self._shown = None
        try:
            self._shown = self._decoded(last, t_ns, is_stale, early)
        except ValueError:
            self._first = self._done = -1
            raise
        return self._shown

    def _decoded(
        self,
        last: int,
        asked_ns: int,
        is_stale: Callable[[], bool],
        early: Callable[[PictureAt], None],
    ) -> PictureAt | None:
        """Decode on from the packet after the last one that was."""
        times = self._packets.t_ns
        found = self._reader.messages(
            topic=self._packets.topic,
            from_ns=int(times[self._done + 1]),
            before_ns=int(times[last]) + 1,
        )
        shown: PictureAt | None = None
        for encoded in found:
            packet = self._reader.decoded(encoded)
            assert isinstance(packet, EncodedFrame)
            self._done += 1
            is_early = self._done == self._first and last - self._done >= EARLY_PACKETS
            lenses = self._decoder.lenses(packet, is_wanted=self._done == last or is_early)
            if lenses is not None:
                shown = PictureAt(asked_ns, packet.t_ns, lenses[0], lenses)
            if is_early and shown is not None:
                early(shown)
                shown = None
            if self._done < last and is_stale():
                return None
        return shown


class PictureThread:
    """Decodes what was asked for last; older requests that it did not get to are dropped.

    Args:
        index: of the recording.
        scene: that is open: what live surfaces show is made, too; None leaves them empty.
    """

    def __init__(self, index: RecordingIndex, scene: ScenePackage | None = None) -> None:
        self.pictures: Slot[PictureAt] = Slot()
        self.live: Slot[tuple[LivePicture, ...]] = Slot()
        """What live surfaces show at the time that was asked for last."""
        self.problems: Slot[str] = Slot()
        self._index = index
        self._wanted: Slot[int] = Slot()
        self._newer = threading.Event()
        self._replay = None if scene is None else LiveReplay(index, scene)
        self._thread = threading.Thread(target=self._run, name="pictures", daemon=True)
        self._thread.start()

    def ask(self, t_ns: int) -> None:
        """Want the picture at a time, and none that was asked for before."""
        self._newer.set()
        with suppress(StreamClosedError):
            self._wanted.put(t_ns)

    def stop(self) -> None:
        """End; waits for the packet that is being decoded."""
        self._newer.set()
        self._wanted.close()
        self._thread.join()

    def _run(self) -> None:
        packets = self._index.packets
        if packets is None:
            return
        try:
            reader = PictureReader(self._index.path, packets)
        except (ValueError, OSError) as error:
            self.problems.put(str(error))
            return
        try:
            while (t_ns := self._wanted.take(timeout_s=None)) is not None:
                self._newer.clear()
                try:
                    picture = reader.picture_at(
                        t_ns, is_stale=self._newer.is_set, early=self.pictures.put
                    )
                except (ValueError, OSError) as error:
                    self.problems.put(str(error))
                    continue
                if picture is not None:
                    self.pictures.put(picture)
                    self._show_surfaces(picture)
        finally:
            reader.close()

    def _show_surfaces(self, picture: PictureAt) -> None:
        """Unless another time is wanted by now: they take longer than the picture."""
        if self._replay is None or not self._replay.has_any or self._newer.is_set():
            return
        try:
            self.live.put(self._replay.at(picture.asked_ns, picture.t_ns, picture.lenses))
        except ValueError as error:
            self.problems.put(f"a live surface: {error}")
