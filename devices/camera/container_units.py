"""Encoded units out of anything that FFmpeg opens: files, RTSP, UDP, HLS, V4L2."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any, cast

import av
from av.error import FFmpegError

from devices.camera.address import DEVICE_MODES, AddressKind, CameraAddress
from devices.camera.annex_b import (
    BitstreamError,
    ParameterSets,
    avc_parameter_sets,
    hevc_parameter_sets,
    with_start_codes,
)
from devices.camera.ts_datagrams import TsDatagrams
from devices.camera.units import SourceError, StreamFormat, Unit
from devices.video_files import PAIRED

LOW_DELAY = {
    "flags": "low_delay",
    "fpsprobesize": "0",
    "probesize": "32768",
    "analyzeduration": "0",
    "max_delay": "0",
}
"""FFmpeg options by which a stream is handed on as it comes. Measured with RTSP on loopback:
without `fpsprobesize` opening takes 1.1 s instead of 0.4 s, for the rate is counted; with
`fflags=nobuffer` the pictures read meanwhile are dropped, the keyframe with them."""

LOCAL = frozenset({AddressKind.FILE, AddressKind.V4L2})
"""Addresses that are a path on this computer."""

CONNECTED = frozenset({AddressKind.RTSP, AddressKind.HLS})
"""Addresses where FFmpeg itself talks to the network."""

DEVICE_ADVICE = {
    errno.ENOENT: "no such device: plug the camera in, or look for another number of /dev/video*",
    errno.ENODEV: "the camera was unplugged: plug it in again",
    errno.EBUSY: "another program uses the camera: close it",
    errno.EACCES: "this user may not read it: add the user to the group video and log in again",
    errno.ENOTTY: "this is no camera: wanted a video device such as /dev/video0",
    errno.EISDIR: "this is no camera: wanted a video device such as /dev/video0",
    errno.EINVAL: "the camera lacks this size, rate or format: v4l2-ctl --list-formats-ext has all",
}
"""Advice on a V4L2 device, by the system's error number."""

PATIENCE_S = 20.0
"""Seconds that FFmpeg may wait for the network. The process that it runs in is killed sooner."""

PARAMETER_SETS = {"h264": avc_parameter_sets, "hevc": hevc_parameter_sets}
"""Readers of the codecs' configuration records."""


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
        self._readers: list[Iterator[Unit]] = []
        self.tracks = 0
        try:
            for name in _names(address):
                self._add(_open(address, name, self._stack))
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

    def __iter__(self) -> Iterator[Unit]:
        """Units in the order they come.

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


def _units(container: Any, streams: list[Any], first_track: int) -> Iterator[Unit]:
    codings = {stream.index: _Coding(stream) for stream in streams}
    tracks = {stream.index: first_track + k for k, stream in enumerate(streams)}
    for packet in container.demux(streams):
        if packet.size:
            yield codings[packet.stream_index].unit(packet, tracks[packet.stream_index])


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
    """Names to open for an address: two files if the camera writes one a lens."""
    path = Path(address.path)
    if address.kind is AddressKind.FILE and path.suffix.lower() == ".insv":
        other = path.with_name(path.name.replace(*PAIRED))
        if PAIRED[0] in path.name and other.exists():
            return [str(path), str(other)]
    return [address.path if address.kind in LOCAL else address.text]


def _options(address: CameraAddress) -> tuple[str | None, dict[str, str]]:
    """FFmpeg's name of the input format, None to find it out; and its options."""
    kind = address.kind
    if kind is AddressKind.V4L2:
        asked = {DEVICE_MODES[name]: value for name, value in address.modes}
        return "video4linux2", {**LOW_DELAY, **asked}
    if kind is AddressKind.RTSP:
        return None, {**LOW_DELAY, "rtsp_transport": "udp" if address.udp_transport else "tcp"}
    if kind is AddressKind.UDP:
        # Tables and the first keyframe come somewhere in the first half second.
        return "mpegts", {**LOW_DELAY, "probesize": "1000000", "analyzeduration": "500000"}
    return None, {} if kind is AddressKind.FILE else {**LOW_DELAY, "live_start_index": "-1"}


def _open(address: CameraAddress, name: str, stack: ExitStack) -> Any:
    """FFmpeg's container; `stack` closes it."""
    form, options = _options(address)
    file: Any = name
    if address.kind is AddressKind.UDP:
        file = stack.enter_context(closing(TsDatagrams(address.host, address.port)))
    patience_s = PATIENCE_S if address.kind in CONNECTED else None
    try:
        opened = av.open(file, format=form, options=options, timeout=patience_s)
    except (FFmpegError, OSError, ValueError) as error:
        raise _refusal(address, error) from None
    return stack.enter_context(cast("Any", opened))


def _refusal(address: CameraAddress, error: Exception) -> SourceError:
    """Why it cannot be opened, with what to do."""
    code = getattr(error, "errno", None)
    if address.kind is AddressKind.V4L2:
        advice = DEVICE_ADVICE.get(
            code or 0, "list the computer's cameras: v4l2-ctl --list-devices"
        )
        # What is unplugged or busy now may be free later; a wrong path stays wrong.
        is_final = code in (errno.ENOTTY, errno.EISDIR, errno.EINVAL, errno.EACCES)
        return SourceError(
            f"{address.shown}: cannot be opened ({_why(error)}); {advice}", is_final=is_final
        )
    advice = (
        "" if address.kind is AddressKind.FILE else "; is the camera on, and its address right?"
    )
    return SourceError(
        f"{address.shown}: cannot be opened ({_why(error)}){advice}",
        is_final=address.kind is AddressKind.FILE,
    )


def _is_cover(stream: Any) -> bool:
    """Whether a picture track is only a still picture that stands for the file."""
    return bool(int(stream.disposition) & 0x400)


def _why(error: BaseException) -> str:
    return str(getattr(error, "strerror", None) or error)
