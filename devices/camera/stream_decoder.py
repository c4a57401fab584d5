"""Units of a camera to its pictures: one decoder a track, a picture once every track has one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import av
from av.codec.context import ThreadType
from av.error import FFmpegError
from av.video.frame import VideoFrame

from devices.camera.stream_picture import StreamPicture, picture_of
from devices.camera.unit_sets import Place, UnitSets
from devices.camera.units import SourceError, StreamFormat, Unit

CODECS = frozenset({"h264", "hevc", "mjpeg", "rawvideo"})
"""Codecs that are decoded, by FFmpeg's names: those that 360° cameras are known to send."""

DECODER_THREADS = 2
"""Threads that share the slices of one picture; a thread a picture would add a picture of delay."""

MAX_SIDE_PX = 8192
"""Longest side of a picture that is decoded: the largest 360° video of today, 8K, is 7680 px."""


@dataclass(frozen=True, slots=True, eq=False)
class DecodedPictures:
    """Pictures of a camera at one moment.

    Attributes:
        number: of the unit that the last of the pictures came in.
        pictures: one for all lenses, or one a lens where the camera sends a track a lens.
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

    def decode(self, unit: Unit, number: int) -> DecodedPictures | None:
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
        track.picture = None if decoded is None else decoded.picture
        return self._whole(decoded) if place is Place.LAST else None

    def leave_out(self, track: int) -> None:
        """Units of a track before the next one, a keyframe, were left out; the first leads."""
        if not track:
            self._sets.begin()
        decoder = self._tracks[track].decoder
        if decoder is not None:
            decoder.leave_out()

    def flush(self) -> list[DecodedPictures]:
        """Return the pictures that the decoders still hold after the last unit."""
        decoded: Decoded | None = None
        for track in self._tracks:
            decoded = None if track.decoder is None else track.decoder.flush()
            track.picture = None if decoded is None else decoded.picture
        whole = self._whole(decoded)
        return [] if whole is None else [whole]

    def _whole(self, last: Decoded | None) -> DecodedPictures | None:
        """The picture of all tracks, once the last one's is there; None if one has none."""
        pictures = tuple(track.picture for track in self._tracks if track.picture is not None)
        self._forget()
        if last is None or len(pictures) < len(self._tracks):
            return None
        return DecodedPictures(last.number, pictures)

    def _forget(self) -> None:
        for track in self._tracks:
            track.picture = None


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
