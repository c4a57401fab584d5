"""Encoded units to pictures with the least delay: one in, at most one out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import av
from av.codec.context import ThreadType
from av.error import FFmpegError
from av.video.frame import VideoFrame

from devices.camera.stream_picture import StreamPicture, picture_of
from devices.camera.units import SourceError, StreamFormat, Unit

CODECS = frozenset({"h264", "hevc", "mjpeg", "rawvideo"})
"""Codecs that are decoded, by FFmpeg's names: those that 360° cameras are known to send."""

DECODER_THREADS = 2
"""Threads that share the slices of one picture; a thread a picture would add a picture of delay."""

MAX_SIDE_PX = 8192
"""Longest side of a picture that is decoded: the largest 360° video of today, 8K, is 7680 px."""


@dataclass(frozen=True, slots=True, eq=False)
class Decoded:
    """A picture and the number of the unit that it came in."""

    number: int
    picture: StreamPicture


class UnitDecoder:
    """Decodes the units of one connection.

    Args:
        form: how they are coded.

    Attributes:
        damaged: units that gave no picture because they are damaged.

    Raises:
        SourceError: the codec is none that is decoded.
    """

    def __init__(self, form: StreamFormat) -> None:
        if form.codec not in CODECS:
            raise SourceError(
                f"pictures coded as {form.codec}: wanted {', '.join(sorted(CODECS))}; set the "
                "camera to H.264",
                is_final=True,
            )
        self.damaged = 0
        self._is_intra = form.codec not in ("h264", "hevc")
        self._started = self._is_intra
        self._context = _open(form)

    def decode(self, unit: Unit, number: int) -> Decoded | None:
        """The picture that a unit completes; None before a keyframe and where it is damaged.

        Args:
            unit: one encoded picture.
            number: returned with the picture.
        """
        if not (self._started or unit.keyframe):
            return None
        packet = av.Packet(unit.data)
        packet.pts = packet.dts = number
        return self._newest(packet, number)

    def leave_out(self) -> None:
        """Forget the pictures that later ones refer to; decoding goes on at a keyframe."""
        self._context.flush_buffers()
        self._started = self._is_intra

    def flush(self) -> Decoded | None:
        """The newest picture that the decoder still holds after the last unit."""
        return self._newest(None, -1)

    def _newest(self, packet: Any, number: int) -> Decoded | None:
        try:
            frames = cast("list[VideoFrame]", self._context.decode(packet))
        except FFmpegError:
            self.damaged += packet is not None
            return None
        self._started = True
        whole = [frame for frame in frames if not frame.is_corrupt]
        self.damaged += len(frames) - len(whole)
        if not whole:
            return None
        frame = whole[-1]
        if max(frame.width, frame.height) > MAX_SIDE_PX:
            raise SourceError(
                f"pictures of {frame.width}×{frame.height} px: wanted at most {MAX_SIDE_PX} px a "
                "side; choose a smaller resolution in the camera",
                is_final=True,
            )
        return Decoded(number if frame.pts is None else frame.pts, picture_of(frame))


def _open(form: StreamFormat) -> Any:
    context = cast("Any", av.CodecContext.create(form.codec, "r"))
    context.thread_type = ThreadType.SLICE
    context.thread_count = DECODER_THREADS
    context.options = {"flags": "low_delay", "max_pixels": str(MAX_SIDE_PX * MAX_SIDE_PX)}
    if form.header:
        context.extradata = form.header
    if form.pixels:
        context.width, context.height, context.pix_fmt = form.width_px, form.height_px, form.pixels
    return context
