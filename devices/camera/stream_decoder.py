"""Units of a camera to its pictures: one decoder a track, a picture once every track has one.

A picture is left in the planes that the decoder wrote, Y, U and V: one of 5760×2880 px takes
longer to convert to RGB than to decode, so only what is used of it is converted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import av
import numpy as np
from av.codec.context import ThreadType
from av.error import FFmpegError
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

from devices.camera.unit_sets import Place, UnitSets
from devices.camera.units import SourceError, StreamFormat, Unit

CODECS = frozenset({"h264", "hevc", "mjpeg", "rawvideo"})
"""Codecs that are decoded, by FFmpeg's names: those that 360° cameras are known to send."""

DECODER_THREADS = 2
"""Threads that share the slices of one picture; a thread a picture would add a picture of delay."""

MAX_SIDE_PX = 8192
"""Longest side of a picture that is decoded: the largest 360° video of today, 8K, is 7680 px."""

Plane = NDArray[np.uint8]

PLANAR = frozenset({"yuv420p", "yuvj420p"})
"""FFmpeg's pixel formats whose planes are used as they are."""

FULL_RANGE = 2
"""FFmpeg's number of the colour range in which Y runs from 0 to 255."""

BT601_SPACES = frozenset({5, 6})
"""FFmpeg's numbers of the two colour spaces of BT.601."""


@dataclass(frozen=True, slots=True, eq=False)
class Decoded:
    """Pictures of a camera at one moment.

    Attributes:
        number: of the unit that the last of the pictures came in.
        pictures: one of a track; of all tracks one for all lenses, or one a lens where the camera
            sends a track a lens.
    """

    number: int
    pictures: tuple[StreamPicture, ...]


@dataclass(slots=True)
class _Track:
    """One picture track: its decoder, and its part of the picture that is not whole yet."""

    form: StreamFormat | None = None
    decoder: UnitDecoder | None = None
    picture: StreamPicture | None = None


class StreamDecoder:
    """Decodes all tracks of a camera; the same units always give the same pictures.

    Args:
        tracks: picture tracks of which one unit each make a picture of the camera.

    Attributes:
        damaged: units that gave no picture because they are damaged.
    """

    def __init__(self, tracks: int) -> None:
        self.damaged = 0
        self._tracks = [_Track() for _ in range(tracks)]
        self._sets = UnitSets(tracks)

    def begins(self, unit: Unit) -> bool:
        """Whether the unit is the first of a stream, for which its track's decoder starts anew."""
        # Another connection has another format object, even where it says the same.
        return self._tracks[unit.track].form is not unit.format

    def decode(self, unit: Unit, number: int) -> Decoded | None:
        """The pictures that a unit completes.

        Args:
            unit: the next encoded picture.
            number: returned with the pictures.

        Raises:
            SourceError: the codec is none that is decoded, or the picture is too large.
        """
        track = self._tracks[unit.track]
        if track.decoder is None or self.begins(unit):
            track.form, track.decoder = unit.format, UnitDecoder(unit.format)
        place = self._sets.place(unit.track)
        if place is Place.FIRST:
            self._forget()
        damaged = track.decoder.damaged
        decoded = track.decoder.decode(unit, number)
        self.damaged += track.decoder.damaged - damaged
        track.picture = None if decoded is None else decoded.pictures[0]
        return self._whole(decoded) if place is Place.LAST else None

    def leave_out(self, track: int) -> None:
        """Units of a track before the next one, a keyframe, were left out; the first leads."""
        if not track:
            self._sets.begin()
        decoder = self._tracks[track].decoder
        if decoder is not None:
            decoder.leave_out()

    def flush(self) -> list[Decoded]:
        """Return the pictures that the decoders still hold after the last unit."""
        decoded: Decoded | None = None
        for track in self._tracks:
            decoded = None if track.decoder is None else track.decoder.flush()
            track.picture = None if decoded is None else decoded.pictures[0]
        whole = self._whole(decoded)
        return [] if whole is None else [whole]

    def _whole(self, last: Decoded | None) -> Decoded | None:
        """The picture of all tracks, once the last one's is there; None if one has none."""
        pictures = tuple(track.picture for track in self._tracks if track.picture is not None)
        self._forget()
        if last is None or len(pictures) < len(self._tracks):
            return None
        return Decoded(last.number, pictures)

    def _forget(self) -> None:
        for track in self._tracks:
            track.picture = None


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
        return Decoded(number if frame.pts is None else frame.pts, (picture_of(frame),))


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


@dataclass(frozen=True, slots=True, eq=False)
class StreamPicture:
    """One picture, 4:2:0.

    Attributes:
        y: (H, W) uint8, read-only.
        u: (⌈H/2⌉, ⌈W/2⌉) uint8.
        v: likewise.
        is_full_range: whether Y runs from 0 to 255 instead of 16 to 235.
        matrix: "bt601" or "bt709".
    """

    y: Plane
    u: Plane
    v: Plane
    is_full_range: bool = False
    matrix: str = "bt709"

    @property
    def width_px(self) -> int:
        """Width of the picture."""
        return int(self.y.shape[1])

    @property
    def height_px(self) -> int:
        """Height of the picture."""
        return int(self.y.shape[0])

    def rgb(self) -> NDArray[np.uint8]:
        """The whole picture, (H, W, 3) uint8; one row or column less where H or W is odd."""
        height, width = self.height_px & ~1, self.width_px & ~1
        half = (slice(height // 2), slice(width // 2))
        return self.to_rgb(self.y[:height, :width], self.u[half], self.v[half])

    def to_rgb(self, y: Plane, u: Plane, v: Plane) -> NDArray[np.uint8]:
        """Any planes of this picture's colours as RGB.

        Args:
            y: (h, w), both even.
            u: (h/2, w/2).
            v: likewise.

        Returns:
            (h, w, 3) uint8.
        """
        height, width = y.shape
        planes = np.empty((height * 3 // 2, width), np.uint8)
        planes[:height] = y
        chroma = planes[height:].reshape(2, height // 2, width // 2)
        chroma[0], chroma[1] = u, v
        frame = cast("Any", VideoFrame.from_numpy_buffer(planes, format="yuv420p"))
        converted = frame.reformat(
            format="rgb24",
            src_colorspace=Colorspace.ITU601 if self.matrix == "bt601" else Colorspace.ITU709,
            src_color_range=ColorRange.JPEG if self.is_full_range else ColorRange.MPEG,
        )
        return np.asarray(converted.to_ndarray(), dtype=np.uint8)


def picture_of(frame: VideoFrame) -> StreamPicture:
    """A decoded frame's picture; its planes are shared with it where it has 4:2:0 planes."""
    is_full = int(frame.color_range) == FULL_RANGE or frame.format.name.startswith("yuvj")
    matrix = "bt601" if int(frame.colorspace) in BT601_SPACES else "bt709"
    if frame.format.name not in PLANAR:
        # swscale keeps the range only where both ranges are given: it is left as it is.
        frame = frame.reformat(format="yuvj420p" if is_full else "yuv420p")
    width, height = frame.width, frame.height
    half = (-(-height // 2), -(-width // 2))
    y, u, v = (
        _plane(plane, shape)
        for plane, shape in zip(frame.planes, ((height, width), half, half), strict=True)
    )
    return StreamPicture(y, u, v, is_full, matrix)


def _plane(plane: Any, shape: tuple[int, int]) -> Plane:
    data = np.frombuffer(cast("bytes", plane), np.uint8)
    rows = data[: shape[0] * plane.line_size].reshape(shape[0], plane.line_size)
    view = rows[:, : shape[1]]
    view.setflags(write=False)
    return view
