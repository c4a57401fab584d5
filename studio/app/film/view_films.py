"""Filming a view from the window: actions, and a bar that shows how far the film is."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QLabel, QProgressBar, QPushButton, QWidget

from devices.streams import Slot
from studio.app.film.film_job import FilmJob
from studio.app.film.film_picture import FilmSet
from studio.app.film.moments import Moment
from studio.app.film.plan import FilmPlan
from studio.app.model.actions import Action, Choice
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.drawing.view_memory import ViewMemory
from studio.app.viewport.insets.insets import Insets
from studio.app.viewport.insets.sources import sources_of, title_of
from studio.app.viewport.layers import Layers
from studio.app.viewport.view import TwinView

POLL_MS = 50
"""Between two looks at the thread that draws."""

BUSY = "film of a view"
"""Keeps `wait.idle` of scripts waiting for a film that has an end."""

SAID_EVERY = 0.1
"""Share of a film after which the log says how far it is."""


class Filmed(Protocol):
    """The views that can be filmed; see `ViewGrid`."""

    views: list[TwinView]
    active: TwinView
    layers: Layers
    drawings: Drawings

    @property
    def insets(self) -> Insets:
        """The small pictures."""
        ...


class ViewFilms(QWidget):
    """One film at a time. The bar is there while one is made.

    Args:
        bench: what is shown.
        filmed: its views.
    """

    def __init__(self, bench: Workbench, filmed: Filmed) -> None:
        super().__init__()
        self.bench = bench
        self._filmed = filmed
        self.job: FilmJob | None = None
        self._view: TwinView | None = None
        self._ticks = 0
        self._said = 0.0
        self._lasts: int | None = None
        self._build()
        self._clock = QTimer(self)
        self._clock.setTimerType(Qt.TimerType.PreciseTimer)
        self._clock.timeout.connect(self._tick)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._poll)
        bench.listen(Topic.SCENE, self.cancel)
        for action in self._actions():
            bench.actions.add(action)

    def _build(self) -> None:
        self.words, self.progress = QLabel(), QProgressBar()
        self.progress.setRange(0, 1000)
        self.progress.setTextVisible(False)
        self.progress.setAccessibleName("share of the film that is made")
        self.end_button, self.cancel_button = QPushButton("End the film"), QPushButton("Cancel")
        self.end_button.setToolTip("The film ends here and is kept")
        self.cancel_button.setToolTip("Nothing of the film is kept")
        self.end_button.clicked.connect(lambda: self.bench.do("view.film_end"))
        self.cancel_button.clicked.connect(lambda: self.bench.do("view.film_cancel"))
        row = QHBoxLayout(self)
        row.setContentsMargins(10, 4, 10, 4)
        row.addWidget(self.words)
        row.addWidget(self.progress, 1)
        row.addWidget(self.end_button)
        row.addWidget(self.cancel_button)
        self.hide()

    @property
    def is_filming(self) -> bool:
        """Whether a film is being made."""
        return self.job is not None

    # --- what can be asked of it -----------------------------------------------------------------

    def start(
        self,
        path: str = "",
        source: str = "",
        *,
        width: int = 1280,
        height: int = 720,
        fps: float = 10.0,
        from_s: float | None = None,
        to_s: float | None = None,
        seconds: float | None = None,
    ) -> None:
        """Film a view: the recording that is open from end to end, else what goes on from now.

        Args:
            path: of the MP4 file; "" asks for it.
            source: number of a view, or the id of the camera, a person or an object; "" is the
                view in hand.
            width: of its pictures, pixels, even.
            height: of its pictures, pixels, even.
            fps: pictures a second.
            from_s: where it begins in the recording, seconds of the session.
            to_s: where it ends there.
            seconds: after which a film of what goes on ends by itself.

        Raises:
            ValueError: a film is being made, there is no such view, or a figure is out of bounds.
        """
        if self.job is not None:
            raise ValueError("a film is being made: end it or cancel it first")
        scene = self.bench.scene
        if scene is None:
            raise ValueError("no room is open: open one, then film it")
        self._check_span(from_s, to_s, seconds)
        view = self._view_of(source)
        if not path:
            self._ask(source)
            return
        pose = None if view is None or view.viewer is None else view.viewer.world_from_camera()
        plan = FilmPlan(
            Path(path),
            int(width),
            int(height),
            float(fps),
            "" if view is not None else source,
            pose,
            from_s,
            to_s,
            self._title(source, view),
        )
        layers, drawing = self._filmed.layers, self._filmed.drawings.of(scene)
        seen = layers.shown, tuple(layers.shapes())
        made_of = FilmSet(drawing, self.bench.document, *seen, memory=ViewMemory(drawing))
        self._view, self._ticks, self._said = view, 0, 0.0
        self._lasts = None if seconds is None else max(1, round(float(seconds) * plan.fps))
        self._begin(FilmJob(plan, made_of, self.bench.recording), plan.fps)

    def _check_span(self, from_s: float | None, to_s: float | None, seconds: float | None) -> None:
        if self.bench.recording is None and (from_s, to_s) != (None, None):
            raise ValueError("from_s, to_s: no recording is open, wanted seconds=… of what goes on")
        if self.bench.recording is not None and seconds is not None:
            raise ValueError("seconds: a recording is open, wanted from_s=… and to_s=… of it")

    def _begin(self, job: FilmJob, fps: float) -> None:
        self.job = job
        if job.is_live:
            self._clock.start(round(1000 / fps))
        if not job.is_live or self._lasts is not None:
            self.bench.busy.add(BUSY)
        self.end_button.setVisible(job.is_live)
        self.progress.setVisible(not job.is_live or self._lasts is not None)
        self.progress.setValue(0)
        self.show()
        self._timer.start(POLL_MS)
        self._say_state()

    def end(self) -> None:
        """End a film of what goes on; it is kept."""
        if self.job is None:
            raise ValueError("nothing is filmed: View → Film a view")
        self._clock.stop()
        self.job.end()
        self.bench.busy.add(BUSY)
        self.end_button.hide()

    def cancel(self) -> None:
        """Keep nothing of the film that is made, if one is."""
        if self.job is not None:
            self._clock.stop()
            self.job.cancel()
            self.job.join()
            self._poll()

    def close_films(self) -> None:
        """The window closes: nothing of a film that is not whole is kept."""
        self.bench.stop_listening(self.cancel)
        self.cancel()

    # --- its parts -------------------------------------------------------------------------------

    def _view_of(self, source: str) -> TwinView | None:
        """The view by hand that is meant; None for a camera's, person's or object's."""
        views, bench = self._filmed.views, self.bench
        if source == "":
            return self._filmed.active
        if str(source).isdecimal():
            number = int(source)
            if not 1 <= number <= len(views):
                raise ValueError(f"view {number}: wanted 1 to {len(views)}")
            return views[number - 1]
        known = sources_of(bench.state, bench.document, bench.scene)
        if source not in known and bench.recording is None:
            raise ValueError(
                f"{source!r}: nobody sees that; wanted the number of a view, or one of "
                f"{', '.join(known)}"
            )
        return None

    def _title(self, source: str, view: TwinView | None) -> str:
        if view is None:
            return title_of(source, self.bench.name_of(source))
        views = self._filmed.views
        return f"view {views.index(view) + 1}" if len(views) > 1 else "the view"

    def _ask(self, source: str) -> None:
        dialog = QFileDialog(self, "Film a view", "view.mp4", "Films (*.mp4)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("mp4")
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.fileSelected.connect(
            lambda chosen: self.bench.do("view.film", path=chosen, source=source)
        )
        dialog.open()

    def _tick(self) -> None:
        """Film this instant of the window."""
        job, bench, view = self.job, self.bench, self._view
        if job is None:
            return
        viewer = None if view is None else view.viewer
        pose = None if viewer is None else viewer.world_from_camera()
        job.add(Moment(bench.state, bench.live, bench.camera_picture, pose, self._ticks))
        self._ticks += 1
        if self._lasts is not None and self._ticks >= self._lasts:
            self.end()

    def _poll(self) -> None:
        job = self.job
        if job is None:
            return
        self._say_share(job.share)
        self._say_state()
        if job.is_running:
            return
        self.job = self._view = None
        self._clock.stop()
        self._timer.stop()
        self.hide()
        self.bench.busy.discard(BUSY)
        self._say_end(job)

    def _say_share(self, shares: Slot[float]) -> None:
        share = shares.take()
        if self._lasts is not None:
            share = self._ticks / self._lasts
        if share is None:
            return
        self.progress.setValue(round(1000 * share))
        if share >= self._said + SAID_EVERY and share < 1.0:
            self._said = share
            self.bench.say("info", f"film: {100 * share:.0f} %")

    def _say_state(self) -> None:
        job = self.job
        if job is None:
            return
        size = f"{job.plan.width_px} × {job.plan.height_px}"
        if not job.is_live:
            self.words.setText(f"Film of {job.plan.title}, {size}")
        else:
            self.words.setText(
                f"● filming {job.plan.title}, {size}: {self._ticks / job.plan.fps:.0f} s"
            )

    def _say_end(self, job: FilmJob) -> None:
        path = job.plan.path
        if job.failure is not None:
            self.bench.say(
                "error", f"{path}: the film could not be made, nothing is kept: {job.failure}"
            )
        elif job.is_made:
            left = f"; {job.left_out} instants came too fast to be drawn" if job.left_out else ""
            self.bench.say("info", f"saved {path}: {job.written} pictures{left}")
        else:
            self.bench.say("info", f"the film was cancelled, nothing of {path} is kept")

    def _choices(self) -> list[Choice]:
        views, bench = self._filmed.views, self.bench
        found = [
            Choice(f"View {n}" if len(views) > 1 else "This view", {"source": str(n)})
            for n in range(1, len(views) + 1)
        ]
        for source in sources_of(bench.state, bench.document, bench.scene):
            name = bench.name_of(source)
            found.append(Choice(name, {"source": source}))
        return found

    def _actions(self) -> list[Action]:
        return [
            Action(
                "view.film",
                "Film a view",
                "View",
                self.start,
                "into an MP4 file: the recording that is open, else what goes on until it is ended",
                arguments=(
                    "path", "source", "width", "height", "fps", "from_s", "to_s", "seconds",
                ),
                available=lambda: self.bench.scene is not None and self.job is None,
                choices=self._choices,
            ),
            Action(
                "view.film_end",
                "End the film of the view",
                "View",
                self.end,
                "it is kept",
                available=lambda: self.job is not None and self.job.is_live,
            ),
            Action(
                "view.film_cancel",
                "Cancel the film of the view",
                "View",
                self.cancel,
                "nothing of it is kept",
                available=lambda: self.job is not None,
            ),
        ]  # fmt: skip
