"""The camera's own packets as one MP4 file, frame by frame as they come."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import av

from devices.messages import EncodedFrame

NANOSECONDS = 1_000_000_000


class PacketFile:
    """Keeps packets in a raw stream beside the video and puts them into it at the end.

    Use it in a `with`. Packets go to the disk at once; only their times are held.

    Args:
        path: the video, `.mp4`; its folder is there.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._raw = path, path.with_suffix(".h264")
        self._file = self._raw.open("wb")
        self._times: list[int] = []

    def add(self, packet: EncodedFrame) -> None:
        """Append a packet of H.264 in Annex B."""
        self._file.write(packet.data)
        self._times.append(packet.t_ns)

    def __enter__(self) -> PacketFile:
        """The writer itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> Literal[False]:
        """Write the video if nothing went wrong; the raw stream goes in any case."""
        self._file.close()
        try:
            if kind is None and self._times:
                self._mux()
        finally:
            self._raw.unlink(missing_ok=True)
        return False

    def _mux(self) -> None:
        containers: Any = av
        with (
            containers.open(str(self._raw), "r", format="h264") as source,
            containers.open(str(self._path), "w") as target,
        ):
            track = target.add_stream_from_template(source.streams.video[0])
            packets = (packet for packet in source.demux(video=0) if packet.size)
            for packet, t_ns in zip(packets, self._times, strict=True):
                packet.stream = track
                packet.time_base = Fraction(1, NANOSECONDS)
                packet.pts = packet.dts = t_ns - self._times[0]
                target.mux(packet)
