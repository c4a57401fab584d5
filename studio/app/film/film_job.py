"""A thread that draws a film and writes it, of a recording or of the window as it goes on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from devices.streams import BoundedQueue, Slot, StreamClosedError, StreamFullError
from scenes.workers.task import Task
from studio.app.film.film_picture import FilmSet, film_picture
from studio.app.film.moments import Moment, recorded_moments
from studio.app.film.plan import FilmPlan
from studio.app.model.names import CAMERA
from studio.app.timeline.recorded.reading import read_index
from studio.reports.mp4_file import Mp4File

WAITING = 8
"""Instants that wait to be drawn: what comes while so many wait is left out."""

READING = 0.1
"""Share of a film's progress that reading its recording counts for."""


class FilmJob:
    """One film.

    Args:
        plan: what it is to be.
        made_of: what it is drawn with.
        recording: its file; None films what `add` is given, until `end`.
    """

    def __init__(self, plan: FilmPlan, made_of: FilmSet, recording: Path | None) -> None:
        self.plan = plan
        self.is_live = recording is None
        self.share: Slot[float] = Slot()
        """How much of it is made, 0..1; of a recording only."""
        self.failure: Exception | None = None
        self.is_made = False
        self.left_out = 0
        """Instants that found too many waiting; the picture before stays that long."""
        self.written = 0
        """Pictures in the file."""
        self._made_of, self._recording = made_of, recording
        self._moments: BoundedQueue[Moment] = BoundedQueue(WAITING, name="film of a view")
        self._task = Task("film of a view", self._run)
        self._task.start()

    @property
    def is_running(self) -> bool:
        """Whether it is still at work."""
        return self._task.is_running

    @property
    def is_cancelled(self) -> bool:
        """Whether it was asked to stop, so that nothing of it is kept."""
        return self._task.is_cancelled

    def add(self, moment: Moment) -> None:
        """Film an instant of the window; it is left out and counted where too many wait."""
        try:
            self._moments.put(moment)
        except StreamFullError:
            self.left_out += 1
        except StreamClosedError:
            pass  # it has ended, or failed: `failure` says why

    def end(self) -> None:
        """Nothing more comes: what waits is drawn, and the film is whole."""
        self._moments.close()

    def cancel(self) -> None:
        """Keep nothing; does not wait."""
        self._task.cancel()
        self._moments.close()

    def join(self) -> None:
        """Wait for its end."""
        self._task.join()

    def _run(self, _task: Task[None]) -> None:
        try:
            self._made_of.drawing.prepare()
            self._film()
            self.is_made = not self.is_cancelled
        except _CancelledError:
            pass
        except Exception as error:  # noqa: BLE001 - shown in the window, which lives on
            self.failure = error
        finally:
            self._moments.close()

    def _film(self) -> None:
        plan = self.plan
        plan.path.parent.mkdir(parents=True, exist_ok=True)
        with Mp4File(plan.path, plan.fps) as file:
            for moment in self._waiting() if self._recording is None else self._recorded():
                if self.is_cancelled:
                    raise _CancelledError
                file.add(film_picture(self._made_of, plan, moment), at=moment.place)
                self.written += 1
            if not self.written:
                raise ValueError(f"{plan.path}: nothing was filmed; film for a second at least")

    def _waiting(self) -> Iterator[Moment]:
        while (moment := self._moments.take(timeout_s=None)) is not None:
            yield moment

    def _recorded(self) -> Iterator[Moment]:
        assert self._recording is not None
        plan, made_of = self.plan, self._made_of
        index = read_index(
            self._recording,
            progress=lambda share: self._say(READING * share),
            cancelled=self._task.cancelled,
        )
        if index is None:
            raise _CancelledError
        times = plan.times_ns(index.start_ns, index.end_ns, origin_ns=index.origin_ns)
        found = recorded_moments(
            index,
            made_of.scene,
            made_of.document,
            times_ns=times,
            shows_camera=plan.source == CAMERA,
        )
        for moment in found:
            yield moment
            self._say(READING + (1 - READING) * (moment.place + 1) / len(times))

    def _say(self, share: float) -> None:
        with suppress(StreamClosedError):
            self.share.put(share)


class _CancelledError(Exception):
    """It was cancelled: the file goes with it."""
