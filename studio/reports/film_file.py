"""The film is drawn and written while the session runs: in line, or behind a bounded queue."""

from __future__ import annotations

import threading
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
from av.container import OutputContainer
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream

from devices.streams import BoundedQueue, StreamClosedError, StreamFullError
from studio.reports.film import FilmFrame, FilmMaker, Picture

QUEUE = 128
"""Frames that may wait to be drawn: some 90 MB, 12 s of a session at 10 Hz."""

SPARE_STILLS = 4
"""Kept pictures per wanted still. A still is off its even place by at most an eighth of the way to
the next one."""


class Stills:
    """Keeps some pictures of a film, evenly apart, however long it becomes.

    Args:
        count: pictures wanted; `SPARE_STILLS` times as many are in memory at most.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._kept: list[tuple[int, float, Picture]] = []
        self._stride = 1
        self._last: tuple[int, float, Picture] | None = None
        self._seen = 0

    def add(self, seconds: float, picture: Picture) -> None:
        """Take the film's next picture and its time."""
        self._last = (self._seen, seconds, picture)
        if self._seen % self._stride == 0:
            self._kept.append(self._last)
        self._seen += 1
        if len(self._kept) > SPARE_STILLS * self._count:
            self._kept = self._kept[::2]
            self._stride *= 2

    def chosen(self) -> list[tuple[float, Picture]]:
        """(seconds, picture) from the first to the last, in order; all of a very short film."""
        if self._last is None:
            return []
        last = self._last[0]
        places = {index: (t, picture) for index, t, picture in [*self._kept, self._last]}
        wanted = [i * last / max(self._count - 1, 1) for i in range(self._count)]
        chosen = {min(places, key=lambda index: abs(index - place)) for place in wanted}
        return [places[index] for index in sorted(chosen)]


class FilmFile:
    """Draws frames and writes them as H.264 (yuv420p) that every player opens.

    Use as a context manager: the file has its name when the block ends well, else nothing stays.

    Args:
        path: of the MP4 file.
        maker: draws the pictures.
        fps: pictures a second of the film, whatever times the frames have.
        stills: pictures to keep for the report.
    """

    def __init__(self, path: Path, maker: FilmMaker, fps: float, *, stills: int) -> None:
        self._path = path
        self._part = path.with_name(path.name + ".part")
        self._maker = maker
        self._rate = Fraction(fps).limit_denominator(1001)
        self._container: OutputContainer | None = None
        self._stream: VideoStream | None = None
        self._count = 0
        self._stills = Stills(stills)

    @property
    def stills(self) -> list[tuple[float, Picture]]:
        """(seconds, picture) of some of the pictures, evenly apart."""
        return self._stills.chosen()

    def add(self, frame: FilmFrame) -> None:
        """Draw and write one picture.

        Raises:
            OSError: the disk is full.
        """
        picture = self._maker.picture(frame)
        self._stills.add(frame.t_ns / 1e9, picture)
        self._write(picture)

    def _write(self, picture: Picture) -> None:
        if self._container is None:
            raise ValueError(f"{self._path}: the film was not opened; use it as a context manager")
        if self._stream is None:
            options = {"crf": "21", "preset": "veryfast", "threads": "1"}
            stream = self._container.add_stream("libx264", rate=self._rate, options=options)
            self._stream = cast(VideoStream, stream)
            self._stream.height, self._stream.width = picture.shape[:2]
            self._stream.pix_fmt = "yuv420p"
            self._stream.codec_context.colorspace = Colorspace.ITU709
            self._stream.codec_context.color_range = ColorRange.MPEG
        frame = VideoFrame.from_ndarray(picture, format="rgb24").reformat(
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            dst_color_range=ColorRange.MPEG,
        )
        frame.pts = self._count
        self._container.mux(self._stream.encode(frame))
        self._count += 1

    def __enter__(self) -> FilmFile:
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


class FilmThread:
    """Draws on a thread of its own, so that a session in real time waits for no picture.

    Use as a context manager inside the film's own; its end waits for what is in the queue.

    Args:
        film: used by this object's thread only.
    """

    def __init__(self, film: FilmFile) -> None:
        self._film = film
        self._queue: BoundedQueue[FilmFrame] = BoundedQueue(QUEUE, name="film")
        self._failure: Exception | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="film", daemon=True)
        self.left_out = 0
        """Frames that found the queue full and are not in the film."""

    def add(self, frame: FilmFrame) -> None:
        """Hand over one frame; it is left out and counted where too many wait.

        Raises:
            Exception: drawing or writing failed earlier.
        """
        try:
            self._queue.put(frame)
        except StreamFullError:
            self.left_out += 1
        except StreamClosedError:
            if self._failure is not None:
                raise self._failure from None
            raise

    def _run(self) -> None:
        try:
            while (frame := self._queue.take(timeout_s=None)) is not None:
                if self._stopping.is_set():
                    return
                self._film.add(frame)
        except Exception as error:  # noqa: BLE001 - raised again on the session's thread
            self._failure = error
            self._queue.close()

    def __enter__(self) -> FilmThread:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_rest: object) -> None:
        if kind is not None:
            self._stopping.set()
        self._queue.close()
        self._thread.join()
        if kind is None and self._failure is not None:
            raise self._failure
