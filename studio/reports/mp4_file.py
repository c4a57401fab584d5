"""Pictures into an MP4 that every player opens: H.264, yuv420p, whole or not at all."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.container import OutputContainer
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream
from numpy.typing import NDArray


class Mp4File:
    """Writes pictures of one size.

    Use as a context manager: the file has its name when the block ends well, else nothing stays.

    Args:
        path: of the MP4 file; it is called `.part` until it is whole.
        fps: pictures a second.
        crf: quality of H.264, smaller is better.
    """

    def __init__(self, path: Path, fps: float, *, crf: int = 21) -> None:
        self._path = path
        self._part = path.with_name(path.name + ".part")
        self._rate = Fraction(fps).limit_denominator(1001)
        self._crf = crf
        self._container: OutputContainer | None = None
        self._stream: VideoStream | None = None
        self._next = 0

    def add(self, picture: NDArray[np.uint8], *, at: int | None = None) -> None:
        """Write an (H, W, 3) RGB picture of even sides.

        Args:
            picture: all of one size.
            at: its place, in pictures from the start; None is after the last one. Until then the
                picture before it stays.

        Raises:
            OSError: the disk is full.
            ValueError: the file was not opened, or the place is not after the last one.
        """
        if self._container is None:
            raise ValueError(f"{self._path}: the film was not opened; use it as a context manager")
        place = self._next if at is None else at
        if place < self._next:
            raise ValueError(f"{self._path}: picture at {place}, wanted {self._next} or later")
        stream = self._stream or self._opened(self._container, picture)
        frame = VideoFrame.from_ndarray(picture, format="rgb24").reformat(
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            dst_color_range=ColorRange.MPEG,
        )
        frame.pts = place
        self._container.mux(stream.encode(frame))
        self._next = place + 1

    def _opened(self, container: OutputContainer, picture: NDArray[np.uint8]) -> VideoStream:
        options = {"crf": str(self._crf), "preset": "veryfast", "threads": "1"}
        added = container.add_stream("libx264", rate=self._rate, options=options)
        stream = self._stream = cast(VideoStream, added)
        stream.height, stream.width = picture.shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.codec_context.colorspace = Colorspace.ITU709
        stream.codec_context.color_range = ColorRange.MPEG
        return stream

    def __enter__(self) -> Mp4File:
        options = {"movflags": "+faststart"}
        self._container = av.open(str(self._part), "w", format="mp4", options=options)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_rest: object) -> None:
        try:
            if self._container is not None:
                if kind is None and self._stream is not None:
                    self._container.mux(self._stream.encode(None))
                self._container.close()
            if kind is None:
                self._part.replace(self._path)
        finally:
            self._part.unlink(missing_ok=True)
