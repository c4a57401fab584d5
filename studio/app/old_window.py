"""The desktop window: the live twin with the camera's picture beside it."""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, QTimer, QUrl
from PySide6.QtGui import QAction, QCloseEvent, QDesktopServices
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow, QSplitter, QToolBar

from devices.streams import StreamFullError
from scenes.cameras import Pinhole
from scenes.state import SceneState
from studio.app.model.scene_job import SceneJob
from studio.app.orbit import home
from studio.app.panes import CameraPane, TwinPane
from studio.app.worker import TwinPainter, View
from studio.console.rows import exit_code
from studio.rehearsal import Performance
from studio.session.live_surfaces import clicked_surface
from studio.session.pipeline import CancelledError
from studio.session.session import SessionOutput, SessionPlan

POLL_MS = 30
MAX_WIDTH_PX = 960
"""The twin is drawn no wider than this and scaled up: two processor cores draw it live."""

FIELD_OF_VIEW = math.radians(64.0)


class StudioWindow(QMainWindow):
    """One scene. Closing the window cancels what is running and waits for it.

    Args:
        scene: name or path, for the title and for rehearsals started here.
        job: opens the scene and perhaps plays a session.
        rehearse_to: where rehearsals started from the window go.
    """

    def __init__(self, scene: str, job: SceneJob, *, rehearse_to: Path) -> None:
        super().__init__()
        self._scene = scene
        self._rehearse_to = rehearse_to
        self._job = job
        self._painter: TwinPainter | None = None
        self._state = SceneState()
        self._output: SessionOutput | None = None
        self._ended = False
        self.setWindowTitle(f"{scene} · GaussianNexus Studio")
        self.resize(1320, 760)
        self.twin = TwinPane(self._redraw)
        self.camera = CameraPane(self._picked)
        panes = QSplitter(Qt.Orientation.Horizontal)
        panes.addWidget(self.twin)
        panes.addWidget(self.camera)
        panes.setStretchFactor(0, 3)
        panes.setStretchFactor(1, 2)
        self.setCentralWidget(panes)
        (
            self._rehearse_action,
            self._stop_action,
            self._live_action,
            self._report_action,
        ) = self._make_toolbar()
        self._live_action.setCheckable(True)
        self._line = QLabel("opening the scene …")
        self._figures = QLabel("")
        self.statusBar().addWidget(self._line, 1)
        self.statusBar().addPermanentWidget(self._figures)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._poll)
        self._timer.start(POLL_MS)
        job.start()
        self._update_actions()

    @property
    def job(self) -> SceneJob:
        """What is running or ran last."""
        return self._job

    @property
    def line(self) -> str:
        """What the status bar says."""
        return self._line.text()

    def _make_toolbar(self) -> tuple[QAction, QAction, QAction, QAction]:
        bar = QToolBar("session")
        bar.setMovable(False)
        self.addToolBar(bar)
        actions: list[QAction] = []
        for text, hint, slot in (
            ("▶ Rehearse", "play a simulated session in this scene", self._rehearse),
            ("■ Stop", "cancel what is running; nothing is kept", self._stop),
            (
                "Live surface",
                "click four corners in the camera's picture: the twin shows live video there",
                self._pick_surface,
            ),
            ("Open report", "the report of the last rehearsal", self._open_report),
        ):
            action = QAction(text, self)
            action.setToolTip(hint)
            action.triggered.connect(slot)
            bar.addAction(action)
            actions.append(action)
        rehearse, stop, live, report = actions
        return rehearse, stop, live, report

    def _rehearse(self) -> None:
        if not self._job.running:
            plan = SessionPlan(scene=self._scene)
            self._begin(SceneJob(self._scene, plan, self._rehearse_to))

    def _begin(self, job: SceneJob) -> None:
        self._job = job
        self._ended = False
        self._output = None
        job.start()
        self._update_actions()

    def _stop(self) -> None:
        self._line.setText("stopping …")
        self._job.cancel()

    def _pick_surface(self) -> None:
        self.camera.pick(self._live_action.isChecked())

    def _picked(self, clicks_px: NDArray[np.float64] | None) -> None:
        """Make what was clicked in the front lens's picture a live surface."""
        self._live_action.setChecked(False)
        session, output = self._job.session, self._output
        if clicks_px is None or session is None or output is None:
            return
        name = f"surface {len(output.state.surfaces) + 1}"
        try:
            frame, room = output.input.frame, session.scene.room
            surface = clicked_surface(name, clicks_px, frame, output.shown.world_from_rig, room)
            session.make_live(surface)
        except (ValueError, StreamFullError) as error:
            self._line.setText(f"✗ {' '.join(str(error).split())}")

    def _open_report(self) -> None:
        performance = self._job.performance
        if performance is not None:
            page = (performance.folder / "report.html").resolve()
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(page)))

    def _poll(self) -> None:
        """Take what the threads have left since the last time."""
        job = self._job
        if self._painter is None and job.opened is not None:
            self._painter = TwinPainter(job.opened)
            self.twin.look_from(home(job.opened.footprint_m))
        line = job.lines.take()
        if line is not None:
            self._line.setText(line)
        output = job.outputs.take()
        if output is not None:
            self._show(output)
        picture = self._painter.pictures.take() if self._painter is not None else None
        if picture is not None:
            self.twin.show_picture(picture)
        if not job.running and not self._ended:
            self._ended = True
            self._line.setText(_last_words(job))
            self._update_actions()

    def _show(self, output: SessionOutput) -> None:
        is_first = self._output is None
        self._output = output
        self._state = output.state
        self.camera.show_picture(output.input.frame.images[0])
        self._redraw()
        if is_first:
            self._update_actions()
        session = self._job.session
        if session is None:
            return
        stages = {stage.name: stage for stage in session.latencies.stages()}
        track = stages.get("track")
        parts = [f"{output.input.frame.t_ns / 1e9:.1f} s", f"frame {output.input.frame.seq}"]
        if track is not None:
            parts.append(f"tracker p50 {track.p50_ms:.0f} ms, p95 {track.p95_ms:.0f} ms")
        parts.append(f"{self._job.outputs.dropped} not shown")
        self._figures.setText(" · ".join(parts))

    def _redraw(self) -> None:
        orbit = self.twin.orbit
        if self._painter is None or orbit is None:
            return
        scale = min(1.0, MAX_WIDTH_PX / max(self.twin.width(), 1))
        # Even sizes: a picture of half the size shows exactly the same.
        width = 2 * max(8, round(0.5 * self.twin.width() * scale))
        height = 2 * max(8, round(0.5 * self.twin.height() * scale))
        camera = Pinhole.from_fov(width, height, FIELD_OF_VIEW)
        live = self._output.surfaces if self._output is not None else ()
        self._painter.show(View(self._state, camera, orbit.world_from_camera(), live))

    def _update_actions(self) -> None:
        running = self._job.running and not self._ended
        self._rehearse_action.setEnabled(not running and self._job.opened is not None)
        self._stop_action.setEnabled(running)
        self._live_action.setEnabled(running and self._output is not None)
        if not running and self.camera.picking:
            self.camera.pick(False)
            self._live_action.setChecked(False)
        self._report_action.setEnabled(self._job.performance is not None)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Cancel, wait for the threads, close."""
        self._timer.stop()
        self.hide()  # at once, also where the session takes a while to stop
        self._job.cancel()
        if self._painter is not None:
            self._painter.stop()
        event.accept()


def open_window(scene: str, *, rehearse_to: Path) -> int:
    """`nexus studio`: look at a scene, rehearse in it. Returns the exit code.

    Raises:
        KeyboardInterrupt: Ctrl+C, or the process got a signal to end.
        ValueError, OSError: the scene cannot be opened.
    """
    job = _run_window(scene, SceneJob(scene), rehearse_to)
    if job.failure is not None and not isinstance(job.failure, CancelledError):
        raise job.failure
    return 0


def rehearse_in_window(plan: SessionPlan, out: Path) -> Performance:
    """Play a rehearsal in a window, which stays open at its end until the user closes it.

    Raises:
        KeyboardInterrupt: the window was closed before the end.
        ValueError, OSError: an input is bad, or the disk is full.
    """
    job = _run_window(plan.scene, SceneJob(plan.scene, plan, out), out)
    if job.performance is None:
        _raise_failure(job)
    assert job.performance is not None
    return job.performance


def replay_in_window(plan: SessionPlan, watch: Callable[[SessionOutput], None]) -> None:
    """Play a recording in a window.

    Raises:
        KeyboardInterrupt: the window was closed before the end.
        ValueError, OSError: the recording is bad.
    """
    job = _run_window(plan.scene, SceneJob(plan.scene, plan, watch=watch), Path("out/rehearsal"))
    _raise_failure(job)


def _run_window(scene: str, job: SceneJob, rehearse_to: Path) -> SceneJob:
    application = QApplication.instance() or QApplication(["nexus"])
    window = StudioWindow(scene, job, rehearse_to=rehearse_to)
    window.show()
    with _closing_on_signal(window) as signals:
        application.exec()
    if signals:
        raise KeyboardInterrupt
    return job


@contextmanager
def _closing_on_signal(window: QMainWindow) -> Iterator[list[int]]:
    """Ctrl+C closes the window, as its frame's button does; collects the signals that came.

    What is raised in a signal's handler would end in Qt's event loop, which only prints it.
    """
    signals: list[int] = []

    def close(number: int, _frame: FrameType | None) -> None:
        signals.append(number)
        window.close()

    if threading.current_thread() is not threading.main_thread():
        yield signals
        return
    before = {number: signal.signal(number, close) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield signals
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _raise_failure(job: SceneJob) -> None:
    if isinstance(job.failure, CancelledError):
        raise KeyboardInterrupt from None
    if job.failure is not None:
        raise job.failure


def _last_words(job: SceneJob) -> str:
    if isinstance(job.failure, CancelledError):
        return "cancelled; nothing was kept"
    if job.failure is not None:
        return f"✗ {' '.join(str(job.failure).split())}"
    if job.performance is not None:
        missed = exit_code(job.performance.rows)
        verdict = "✗ a figure misses its bar" if missed else "✓ every figure meets its bar"
        return f"{verdict}; the report is in {job.performance.folder}"
    return "ready"
