"""The film is drawn and written while the session runs: in line, or behind a bounded queue."""

from __future__ import annotations

from pathlib import Path

from devices.streams import BoundedQueue, StreamClosedError, StreamFullError
from scenes.workers.task import Task
from studio.reports.film import FilmFrame, FilmMaker, Picture
from studio.reports.mp4_file import Mp4File

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
        self._file = Mp4File(path, fps)
        self._maker = maker
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
        self._file.add(picture)

    def __enter__(self) -> FilmFile:
        self._file.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        self._file.__exit__(kind, *rest)


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
        self._task = Task("film", self._run)
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

    def _run(self, task: Task[None]) -> None:
        try:
            while (frame := self._queue.take(timeout_s=None)) is not None:
                if task.is_cancelled:
                    return
                self._film.add(frame)
        except Exception as error:  # noqa: BLE001 - raised again on the session's thread
            self._failure = error
            self._queue.close()

    def __enter__(self) -> FilmThread:
        self._task.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_rest: object) -> None:
        if kind is not None:
            self._task.cancel()
        self._queue.close()
        self._task.join()
        if kind is None and self._failure is not None:
            raise self._failure
