"""Many recorded packets in a row to pictures, several decoded at once: for going to an instant.

FFmpeg's frame threads give the same pixels as one packet after the other, each picture some packets
late: a group of pictures takes as long as one core needs, divided by the cores.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any, cast

import av
import numpy as np
from av.codec.context import ThreadType
from av.error import FFmpegError
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace, Interpolation
from numpy.typing import NDArray

from devices.camera.lenses.lens_pictures import LensPictures, stream_images
from devices.camera.stream_decoder import picture_of
from devices.messages import EncodedFrame
from devices.session_info import SessionInfo
from devices.video import split_lenses

FRAME_THREADED = frozenset({"h264", "hevc"})
"""Codecs whose packets need those before them; in the others every picture is decoded alone."""

THREADS_PER_CORE, MAX_THREADS = 2, 8
"""Pictures that are decoded at once. A picture waits for the rows of the one before that it moved
from, so cores are idle with one thread each: forty pictures of 2880 × 1440 take two cores 1003 ms
with two threads, 593 with four, 593 with six; 1115 with one. Each holds a picture of 6 MB and comes
a packet later."""


class RunError(ValueError):
    """Packets that are not decoded this way: `PacketPictures` says what is wrong with them."""


@dataclass(frozen=True, slots=True, eq=False)
class RunPicture:
    """A decoded picture that nobody may want: no colours are made yet.

    Attributes:
        number: of the packet that it came in.
        frame: as FFmpeg decoded it.
    """

    number: int
    frame: VideoFrame


class PacketRun:
    """Decodes packets of one track from a keyframe on, each picture some packets late.

    Args:
        session: how it was recorded.
        codec: of the packets, by FFmpeg's name.
        threads: pictures that are decoded at once; None for as many as suit the machine.

    Raises:
        RunError: the codec, or a camera with a track a lens, is not decoded this way.
    """

    def __init__(self, session: SessionInfo, codec: str, *, threads: int | None = None) -> None:
        tracks = 1 if session.stream is None else session.stream.tracks
        if codec not in FRAME_THREADED or tracks > 1:
            raise RunError(f"{tracks} tracks of {codec}: wanted one of H.264 or HEVC")
        self._session = session
        self.threads = threads or min(MAX_THREADS, THREADS_PER_CORE * (os.cpu_count() or 1))
        context = cast("Any", av.CodecContext.create(codec, "r"))
        context.thread_count = self.threads
        context.thread_type = ThreadType.FRAME
        self._context = context

    def feed(self, packet: EncodedFrame, number: int) -> list[RunPicture]:
        """Take the next packet; the pictures that came out meanwhile, mostly of earlier ones.

        Args:
            packet: the first one is a keyframe.
            number: of the packet, growing.

        Raises:
            RunError: it, or one of those before it, is damaged.
        """
        # Of FFmpeg's own memory: its threads free packets, and to free Python's they would wait for
        # the interpreter's lock, which whoever drops the context holds while it waits for them.
        data = av.Packet(len(packet.data))
        data.update(packet.data)
        data.pts = data.dts = number
        return self._out(data)

    def flush(self) -> list[RunPicture]:
        """Return the pictures left after the last packet; nothing can be fed after it.

        Raises:
            RunError: as `feed`.
        """
        return self._out(None)

    def close(self) -> None:
        """Drop what is being decoded; waits for it without holding the interpreter's lock."""
        if self._context.is_open:
            self._context.flush_buffers()

    def _out(self, packet: Any) -> list[RunPicture]:
        try:
            frames = cast("list[VideoFrame]", self._context.decode(packet))
        except FFmpegError as error:
            raise RunError(f"damaged packets ({error.strerror or error})") from None
        if any(frame.is_corrupt or frame.pts is None for frame in frames):
            raise RunError("a picture that is not whole")
        return [RunPicture(int(frame.pts or 0), frame) for frame in frames]

    def lenses(self, picture: RunPicture) -> LensPictures:
        """One upright RGB picture (H, W, 3) a lens, the front one first.

        Raises:
            ValueError: it does not suit the session's lenses.
        """
        if self._session.stream is not None:
            pictures = (picture_of(picture.frame),)
            return stream_images(pictures, self._session.stream)
        rgb = picture.frame.reformat(
            format="rgb24", src_colorspace=Colorspace.ITU709, src_color_range=ColorRange.MPEG
        ).to_ndarray()
        return split_lenses(np.asarray(rgb, np.uint8), len(self._session.rig.lenses))

    def reduced(self, picture: RunPicture, side_px: int) -> NDArray[np.uint8]:
        """The front lens's upright RGB picture (side, side, 3), made small before it has colours.

        Args:
            picture: a decoded one.
            side_px: even, at least 16.

        Raises:
            ValueError: it does not suit the session's lenses.
        """
        stream, lenses = self._session.stream, len(self._session.rig.lenses)
        if stream is not None:
            small = replace(stream, lens_size_px=side_px)
            return stream_images((picture_of(picture.frame),), small)[0]
        rgb = picture.frame.reformat(
            width=side_px * lenses,
            height=side_px,
            format="rgb24",
            src_colorspace=Colorspace.ITU709,
            src_color_range=ColorRange.MPEG,
            interpolation=Interpolation.AREA,
        ).to_ndarray()
        return np.ascontiguousarray(split_lenses(np.asarray(rgb, np.uint8), lenses)[0])
