"""Encoded units out of anything that FFmpeg opens: files, RTSP, UDP, HLS, V4L2."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import av
from av.error import BlockingIOError as NothingYetError
from av.error import FFmpegError

from devices.camera.address import AddressKind, CameraAddress
from devices.camera.annex_b import (
    BitstreamError,
    ParameterSets,
    avc_parameter_sets,
    hevc_parameter_sets,
    with_start_codes,
)
from devices.camera.units import SourceError, StreamFormat, Unit
from devices.footage import PAIRED

LOW_DELAY = {
    "fflags": "nobuffer",
    "flags": "low_delay",
    "probesize": "32768",
    "analyzeduration": "0",
    "max_delay": "0",
}
"""FFmpeg options by which a stream is handed on as it comes; measured on loopback."""

OPEN_S = 4.0
"""Seconds that opening may take: RTSP on loopback takes 1.0 to 1.2 s."""

READ_S = 4.0
"""Seconds without a byte after which a stream is given up, as for a publisher of RTMP."""

NON_BLOCKING = "4"
"""FFmpeg's AVFMT_FLAG_NONBLOCK: V4L2 answers that there is nothing yet instead of waiting."""

PARAMETER_SETS = {"h264": avc_parameter_sets, "hevc": hevc_parameter_sets}
"""What reads a codec's configuration record."""


class ContainerUnits:
    """The picture tracks of one address, opened.

    Args:
        address: anything but RTMP, which has a listener of its own.

    Attributes:
        tracks: picture tracks of which one unit each make a picture.

    Raises:
        SourceError: it cannot be opened or has no picture.
    """

    def __init__(self, address: CameraAddress) -> None:
        self._address = address
        self._stack = ExitStack()
        self._readers: list[Iterator[Unit | None]] = []
        self.tracks = 0
        try:
            for name in _names(address):
                self._add(self._stack.enter_context(_opened(address, name)))
        except BaseException:
            self._stack.close()
            raise

    def _add(self, container: Any) -> None:
        streams = [stream for stream in container.streams.video if not _is_cover(stream)]
        if not streams:
            raise SourceError(f"{self._address.shown}: no picture track in it", is_final=True)
        # Only files hold a track a lens; of a network stream the first is the camera's.
        chosen = streams[:2] if self._address.kind is AddressKind.FILE else streams[:1]
        self._readers.append(_units(container, chosen, self.tracks))
        self.tracks += len(chosen)

    def __iter__(self) -> Iterator[Unit | None]:
        """Units in the order they come; None where a device has nothing yet.

        Raises:
            SourceError: the stream broke.
        """
        try:
            while True:
                for reader in self._readers:
                    unit = next(reader, "end")
                    if isinstance(unit, str):
                        return
                    yield unit
        except (FFmpegError, BitstreamError, OSError) as error:
            raise SourceError(f"{self._address.shown}: the stream broke ({_why(error)})") from None

    def close(self) -> None:
        """Close what was opened."""
        self._stack.close()


def _units(container: Any, streams: list[Any], first_track: int) -> Iterator[Unit | None]:
    codings = {stream.index: _Coding(stream) for stream in streams}
    tracks = {stream.index: first_track + k for k, stream in enumerate(streams)}
    while True:
        try:
            for packet in container.demux(streams):
                if not packet.size:
                    continue
                coding = codings[packet.stream_index]
                yield coding.unit(packet, tracks[packet.stream_index])
        except NothingYetError:
            yield None
            continue
        return


class _Coding:
    """How one track is coded, and its packets as units."""

    def __init__(self, stream: Any) -> None:
        context = stream.codec_context
        header = bytes(context.extradata or b"")
        self._sets: ParameterSets | None = None
        codec = str(context.name)
        codec = {"libdav1d": "av1"}.get(codec, codec)
        if codec in PARAMETER_SETS and header[:1] == b"\x01":
            self._sets = PARAMETER_SETS[codec](header)
            header = self._sets.annex_b
        raw = codec == "rawvideo"
        self.format = StreamFormat(
            codec,
            header,
            int(context.width) if raw else 0,
            int(context.height) if raw else 0,
            str(context.pix_fmt) if raw else "",
        )
        self._tick_ns = 1e9 * float(stream.time_base)

    def unit(self, packet: Any, track: int) -> Unit:
        data = bytes(packet)
        if self._sets is not None:
            data = with_start_codes(data, self._sets.length_bytes)
        if packet.is_keyframe and self.format.codec in PARAMETER_SETS:
            data = self.format.header + data
        pts_ns = None if packet.pts is None else round(packet.pts * self._tick_ns)
        return Unit(self.format, data, bool(packet.is_keyframe), pts_ns, track)


def _names(address: CameraAddress) -> list[str]:
    """What FFmpeg opens for it: two files where a camera writes one a lens."""
    if address.kind is AddressKind.UDP:
        # Without a host FFmpeg listens on every interface.
        host = address.host or "0.0.0.0"
        return [f"udp://{host}:{address.port}?fifo_size=50000&overrun_nonfatal=1"]
    if address.kind not in (AddressKind.FILE, AddressKind.V4L2):
        return [address.text]
    path = Path(address.path)
    if path.suffix.lower() == ".insv" and PAIRED[0] in path.name:
        other = path.with_name(path.name.replace(*PAIRED))
        return [str(path), str(other)] if other.exists() else [str(path)]
    return [str(path)]


def _options(address: CameraAddress) -> tuple[str | None, dict[str, str]]:
    """FFmpeg's name of the input format, None to find it out; and its options."""
    kind = address.kind
    if kind is AddressKind.FILE:
        return None, {}
    if kind is AddressKind.V4L2:
        return "video4linux2", {"fflags": f"nobuffer+{NON_BLOCKING}"}
    if kind is AddressKind.RTSP:
        return None, {**LOW_DELAY, "rtsp_transport": "udp" if address.udp_transport else "tcp"}
    if kind is AddressKind.UDP:
        return "mpegts", {**LOW_DELAY, "probesize": "200000", "analyzeduration": "500000"}
    return None, dict(LOW_DELAY)


def _opened(address: CameraAddress, name: str) -> Any:
    form, options = _options(address)
    blocks = address.kind not in (AddressKind.FILE, AddressKind.V4L2)
    try:
        return av.open(
            name, format=form, options=options, timeout=(OPEN_S, READ_S) if blocks else None
        )
    except (FFmpegError, OSError, ValueError) as error:
        is_final = address.kind is AddressKind.FILE
        raise SourceError(
            f"{address.shown}: cannot be opened ({_why(error)})", is_final=is_final
        ) from None


def _is_cover(stream: Any) -> bool:
    """Whether a picture track is only a still picture that stands for the file."""
    return bool(int(stream.disposition) & 0x400)


def _why(error: BaseException) -> str:
    return str(getattr(error, "strerror", None) or error)
