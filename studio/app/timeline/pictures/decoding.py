"""Two ways to the picture of a packet: several packets at once, or one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from devices.messages import EncodedFrame
from devices.packet_pictures import LensPictures, PacketPictures
from devices.packet_runs import PacketRun, RunError, RunPicture
from devices.recording import RecordingReader
from devices.recording_codec import Encoded
from studio.app.timeline.recorded.index import Packets


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """Picture of a packet.

    Attributes:
        t_ns: when it was taken.
        lenses: one (H, W, 3) RGB a lens, the front one first.
    """

    t_ns: int
    lenses: LensPictures


def packets_from(reader: RecordingReader, packets: Packets, first: int) -> Iterator[Encoded]:
    """The packets of a recording from a number on, not decoded."""
    t_ns = packets.t_ns[first]
    found = reader.messages(topics=packets.topics, from_ns=int(t_ns))
    # Of several tracks, some before the first may have its time.
    return islice(found, first - int(np.searchsorted(packets.t_ns, t_ns)), None)


class InRuns:
    """Decodes several packets at once, and some packets ahead of the one whose picture is wanted.

    What comes after a picture is decoded on from there, whatever keyframes lie between.

    Args:
        reader: of the recording.
        packets: where its pictures are.
        threads: pictures that are decoded at once; None for as many as suit the machine.
    """

    def __init__(
        self, reader: RecordingReader, packets: Packets, *, threads: int | None = None
    ) -> None:
        self._reader = reader
        self._packets = packets
        self._threads = threads
        self._incoming: Iterator[Encoded] = iter(())
        self._run: PacketRun | None = None
        self._came: list[tuple[PacketRun, RunPicture]] = []
        """Pictures that came out and were not asked for yet: some that follow the last one."""
        self._fed = self._done = -1
        """Packets that were fed last, and whose picture was taken last; -1 before the first."""

    def left(self, first: int, last: int) -> int:
        """Packets that have to be decoded for the picture of the last one."""
        return last - self._done if self.goes_on(first, last) else last + 1 - first

    def leave(self) -> None:
        """Begin anew at a keyframe next time."""
        if self._run is not None:
            self._run.close()
        self._run = None
        self._came.clear()
        self._incoming = iter(())
        self._fed = self._done = -1

    def decoded(
        self,
        first: int,
        last: int,
        *,
        is_stale: Callable[[], bool],
        keyframe: Callable[[Shown], None] | None = None,
    ) -> Shown | None:
        """The picture of a packet; None if it became stale.

        Args:
            first: the keyframe before the packet.
            last: the packet.
            is_stale: asked between packets.
            keyframe: is given the keyframe's picture, if that comes on the way.

        Raises:
            RunError: it has to be decoded one by one.
            RecordingError, ValueError: the recording is damaged there.
        """
        if not self.goes_on(first, last):
            self.leave()
            self._fed = self._done = first - 1
            self._incoming = packets_from(self._reader, self._packets, first)
        try:
            return self._decoded(first, last, is_stale, keyframe)
        except ValueError:
            self.leave()
            raise

    def goes_on(self, first: int, last: int) -> bool:
        """Whether decoding on from where it is leaves no packet out, and none comes needlessly."""
        return self._fed > -1 and self._done < last and first <= self._fed + 1

    def _decoded(
        self,
        first: int,
        last: int,
        is_stale: Callable[[], bool],
        keyframe: Callable[[Shown], None] | None,
    ) -> Shown | None:
        while True:
            while self._came:
                run, picture = self._came.pop(0)
                self._done = picture.number
                if picture.number >= last:
                    return self._shown(run, picture, last)
                if picture.number == first and keyframe is not None:
                    keyframe(self._shown(run, picture, first))
            if is_stale():
                return None
            self._feed()

    def _shown(self, run: PacketRun, picture: RunPicture, wanted: int) -> Shown:
        if picture.number != wanted:
            raise RunError(f"packet {wanted} gives no picture")
        return Shown(int(self._packets.t_ns[wanted]), run.lenses(picture))

    def _feed(self) -> None:
        """Take the next packet, or what is left after the last.

        Raises:
            RunError: there is nothing left, or what `PacketRun` raises.
        """
        encoded = next(self._incoming, None)
        packet = None if encoded is None else self._reader.decoded(encoded)
        assert packet is None or isinstance(packet, EncodedFrame)
        run = self._run
        if run is not None and (packet is None or packet.begins):
            self._came.extend((run, picture) for picture in run.flush())
            self._run = run = None
        elif packet is None:
            raise RunError("no packets are left")
        if packet is None:
            return
        if run is None:
            self._run = run = PacketRun(self._reader.session, packet.codec, threads=self._threads)
        self._fed += 1
        self._came.extend((run, picture) for picture in run.feed(packet, self._fed))


class OneByOne:
    """Decodes one packet after the other, as a replay does.

    Going on within the same group of pictures takes only the packets in between.

    Args:
        reader: of the recording.
        packets: where its pictures are.
    """

    def __init__(self, reader: RecordingReader, packets: Packets) -> None:
        self._reader = reader
        self._packets = packets
        self._decoder = PacketPictures(reader.session)
        self._first = self._done = -1
        """Packets that the decoder has taken: the keyframe and the last."""

    def left(self, first: int, last: int) -> int:
        """Packets that have to be decoded for the picture of the last one."""
        return last - self._done if self.goes_on(first, last) else last + 1 - first

    def decoded(
        self,
        first: int,
        last: int,
        *,
        is_stale: Callable[[], bool],
        keyframe: Callable[[Shown], None] | None = None,
    ) -> Shown | None:
        """The picture of a packet; None if it gives none or became stale.

        Args:
            first: the keyframe before the packet.
            last: the packet.
            is_stale: asked between packets.
            keyframe: is given the keyframe's picture, if that comes on the way.

        Raises:
            RecordingError, ValueError: the recording is damaged there.
        """
        if not self.goes_on(first, last):
            self._decoder = PacketPictures(self._reader.session)
            self._first, self._done = first, first - 1
        try:
            return self._decoded(last, is_stale, keyframe)
        except ValueError:
            self._first = self._done = -1
            raise

    def goes_on(self, first: int, last: int) -> bool:
        """Whether the packets between are all that is left to decode."""
        return first == self._first and last > self._done

    def _decoded(
        self, last: int, is_stale: Callable[[], bool], keyframe: Callable[[Shown], None] | None
    ) -> Shown | None:
        found = packets_from(self._reader, self._packets, self._done + 1)
        for encoded in found:
            packet = self._reader.decoded(encoded)
            assert isinstance(packet, EncodedFrame)
            self._done += 1
            is_early = self._done == self._first and keyframe is not None
            lenses = self._decoder.lenses(packet, is_wanted=self._done == last or is_early)
            shown = None if lenses is None else Shown(packet.t_ns, lenses)
            if self._done == last:
                return shown
            if is_early and shown is not None and keyframe is not None:
                keyframe(shown)
            if is_stale():
                return None
        return None
