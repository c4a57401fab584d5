"""The timeline's dock: opens the bench's recording and shows any instant of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QSize, Qt, QTimer, QUrl
from PySide6.QtGui import QCloseEvent, QDesktopServices, QFontDatabase
from PySide6.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QScrollArea,
    QSplitter,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from devices.clock import WallClock
from scenes.state import SceneState
from studio.app.model.document import Marker
from studio.app.model.scene_job import SceneJob
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.theme import THEMES, Theme
from studio.app.timeline.actions import add_timeline_actions
from studio.app.timeline.comparison_view import ComparisonView
from studio.app.timeline.curves import Curves
from studio.app.timeline.forking import comparing, planning_fork, writing_page
from studio.app.timeline.pictures import PictureThread
from studio.app.timeline.playback import Playback
from studio.app.timeline.task import Task
from studio.app.timeline.track_view import TrackView

if TYPE_CHECKING:
    from studio.app.timeline.opening import OpenRecording
    from studio.compare.comparison import Comparison
    from studio.session.session import SessionPlan

POLL_MS = 15
"""Between two looks at clock and threads: below a frame of a 30 Hz view."""

BUTTONS = (
    "timeline.previous",
    "timeline.step_back",
    "timeline.play",
    "timeline.step",
    "timeline.next",
    "timeline.slower",
    "timeline.faster",
    "timeline.loop",
    "timeline.first_failure",
    "timeline.yaw",
    "timeline.mark",
    "timeline.fork",
    "timeline.compare",
    "timeline.close",
)
"""Actions that have a button, from the left."""

EMPTY = (
    "No recording is open. Rehearse (F5), or drop a recording (.mcap) or the folder of a "
    "rehearsal onto the window."
)
LEGEND = (
    ("▦ static", "calm"),
    ("■ tracked", "good"),
    ("▨ occluded", "warning"),
    ("▩ lost", "bad"),
    ("☰ fault", "warning"),
    ("▼ marker", "accent"),
    ("✖ first failure", "bad"),
)
"""Signs, what they stand for, and the theme's colour of each."""


class TimelineDock(QWidget):
    """Transport buttons, rows over time, error curves; comparisons in the same place.

    Args:
        bench: what it shows and what it calls.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self.bench = bench
        self.playback: Playback | None = None
        self.shown: OpenRecording | None = None
        self.comparison: Comparison | None = None
        self._opened: Path | None = None
        self._opening: Task[OpenRecording | None] | None = None
        self._planning: Task[SessionPlan] | None = None
        self._comparing: Task[Comparison] | None = None
        self._page: Task[Path] | None = None
        self._pictures: PictureThread | None = None
        self._state: SceneState | None = None
        self._t_ns = -1
        self._pair: tuple[Path, Path] | None = None
        """Folders of the original and of its fork."""
        self._fork_out = Path()
        self._forks = 0
        self._build()
        add_timeline_actions(self)
        bench.listen(Topic.RECORDING, self._on_recording)
        bench.listen(Topic.DOCUMENT, self._on_document)
        bench.listen(Topic.SETTINGS, self._on_theme)
        bench.listen(Topic.SCENE, self._on_scene)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.poll)
        self._timer.start(POLL_MS)
        self._on_recording()
        QTimer.singleShot(0, self._on_theme)

    # --- construction ----------------------------------------------------------------------------

    def _build(self) -> None:
        self.tracks = TrackView(
            self._theme,
            scrub=self._on_scrub,
            hover=self._on_hover,
            zoomed=self._on_zoom,
            choose=self.bench.select,
        )
        self.curves = Curves()
        area = QScrollArea()
        area.setWidget(self.tracks)
        area.setWidgetResizable(True)
        area.setFrameShape(QScrollArea.Shape.NoFrame)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        split = QSplitter(Qt.Orientation.Vertical)
        split.addWidget(area)
        split.addWidget(self.curves)
        split.setSizes([160, 110])
        self.view = ComparisonView(
            self._leave_comparison, lambda: self.bench.do("timeline.open_page")
        )
        self.empty = QLabel(EMPTY)
        self.empty.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.empty.setWordWrap(True)
        self.pages = QStackedWidget()
        for page in (self.empty, split, self.view):
            self.pages.addWidget(page)
        self._split = split
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(0)
        whole.addLayout(self._transport())
        whole.addWidget(self.pages, 1)
        bottom = QHBoxLayout()
        bottom.setContentsMargins(8, 1, 8, 1)
        self.read_out, self._legend = QLabel(), QLabel()
        bottom.addWidget(self.read_out, 1)
        bottom.addWidget(self._legend)
        whole.addLayout(bottom)

    def _transport(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setContentsMargins(8, 3, 8, 3)
        row.setSpacing(2)
        self.buttons: dict[str, QToolButton] = {}
        for action_id in BUTTONS:
            button = QToolButton()
            button.setAutoRaise(True)
            button.setIconSize(QSize(18, 18))
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(lambda _=False, of=action_id: self.bench.do(of))
            self.buttons[action_id] = button
            row.addWidget(button)
        self.time = QLabel()
        self.time.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.progress = QProgressBar()
        self.progress.setMaximumWidth(160)
        self.progress.setFormat("reading %p %")
        self.progress.hide()
        row.addSpacing(12)
        row.addWidget(self.time)
        row.addStretch(1)
        row.addWidget(self.progress)
        return row

    def sizeHint(self) -> QSize:
        """Room for five objects and the curves."""
        return QSize(900, 300)

    def _theme(self) -> Theme:
        return THEMES[self.bench.settings.theme]

    # --- what changes ----------------------------------------------------------------------------

    def _on_theme(self) -> None:
        import qtawesome  # loads fonts: not before the window is shown

        for action_id, button in self.buttons.items():
            action = self.bench.actions.get(action_id)
            button.setIcon(qtawesome.icon(action.icon, color=self._theme().text))
            keys = f" ({action.keys})" if action.keys else ""
            button.setToolTip(f"{action.title}{keys}" + (f": {action.hint}" if action.hint else ""))
            button.setAccessibleName(action.title)
        theme = self._theme()
        words = [f'<span style="color:{getattr(theme, c)}">{text}</span>' for text, c in LEGEND]
        self._legend.setText(" &nbsp; ".join(words))
        self.tracks.redraw()
        if self.shown is not None:
            self._draw_curves(self.shown)

    def _on_document(self) -> None:
        self.tracks.show_markers(self.bench.document.markers)

    def _on_scene(self) -> None:
        """The scene knows which objects look the same at several yaws: judge errors anew."""
        if self.shown is not None and self.bench.scene is not None and self._opened is not None:
            self._begin_opening(self._opened)

    def _on_recording(self) -> None:
        if self.bench.recording is None:
            self._forget()
            self._opened = None
        elif self.bench.recording != self._opened:
            self._forget()
            self._begin_opening(self.bench.recording)
        self._show_buttons()

    def _begin_opening(self, path: Path) -> None:
        from studio.app.timeline.opening import opening

        if self._opening is not None:
            self._opening.cancel()
        self._opened = path
        self.progress.setValue(0)
        self.progress.show()
        self._opening = opening(path, self.bench.scene)

    def _forget(self) -> None:
        if self._opening is not None:
            self._opening.cancel()
            self._opening = None
        if self._pictures is not None:
            self._pictures.stop()
            self._pictures = None
        self.shown = self.playback = self._state = None
        self._t_ns = -1
        self.progress.hide()
        self.tracks.show_recording(None)
        self.pages.setCurrentWidget(self.empty)
        self.time.clear()
        self.read_out.clear()

    def _show_buttons(self) -> None:
        for action_id, button in self.buttons.items():
            button.setEnabled(self.bench.actions.get(action_id).is_available)
        self._legend.setVisible(self.playback is not None)

    # --- polling ---------------------------------------------------------------------------------

    def poll(self) -> None:
        """Take what the threads have left; move the playhead."""
        self._poll_opening()
        self._poll_fork()
        self._poll_comparison()
        if self.playback is not None:
            self._show_instant(self.playback.t_ns)
        if self._pictures is not None:
            found, problem = self._pictures.pictures.take(), self._pictures.problems.take()
            if found is not None and self._state is not None:
                self.bench.show_state(self._state, camera_picture=found.picture)
            if problem is not None:
                self.bench.say("warning", f"the picture cannot be shown: {problem}")

    def _poll_opening(self) -> None:
        task = self._opening
        if task is None:
            return
        share = task.share.take()
        if share is not None:
            self.progress.setValue(round(100 * share))
        if task.is_running:
            return
        self._opening = None
        self.progress.hide()
        if task.failure is not None:
            self.bench.say("error", task.failure)
            self.bench.open_recording(None)
        elif task.result is not None:
            self._show(task.result)

    def _show(self, shown: OpenRecording) -> None:
        index = shown.index
        if index.is_empty:
            self.bench.say("warning", f"{index.path}: an empty recording: nothing to show")
            self.bench.open_recording(None)
            return
        for text in (shown.stranger, index.shortened):
            if text:
                self.bench.say("warning", text)
        is_again = self.playback is not None
        self.shown = shown
        if self.playback is None:
            self.playback = Playback(
                index.frames_ns.tolist(),
                start_ns=index.start_ns,
                end_ns=index.end_ns,
                clock=WallClock(),
            )
            self._pictures = PictureThread(index)
        self.tracks.show_recording(shown)
        self._on_document()
        self.pages.setCurrentWidget(self._split)
        self._draw_curves(shown)
        # Only now can it be played: whoever shows what can be done must look again.
        self.bench.announce(Topic.RECORDING)
        if not is_again and self._pair is not None and index.path.parent == self._pair[1]:
            self.compare()

    def _draw_curves(self, shown: OpenRecording) -> None:
        self.curves.show_curves(shown.curves, self._theme())
        self.curves.show_span(self.tracks.from_ns, self.tracks.to_ns)

    def _show_instant(self, t_ns: int) -> None:
        if self.shown is None or self.playback is None:
            return
        playing = "▶" if self.playback.is_playing else "‖"
        start_s = self.shown.index.start_ns / 1e9
        loop = "  loop" if self.playback.is_looping else ""
        self.time.setText(
            f"{playing} {t_ns / 1e9:8.3f} s of {start_s + self.shown.index.duration_s:.1f} s"
            f"   ×{self.playback.speed:g}{loop}"
        )
        if t_ns == self._t_ns:
            return
        self._t_ns = t_ns
        self._state = self.shown.index.state_at(t_ns)
        self.tracks.set_playhead(t_ns)
        self.curves.set_playhead(t_ns)
        self.bench.show_state(self._state)
        if self._pictures is not None:
            self._pictures.ask(t_ns)

    def _on_scrub(self, t_ns: int, has_ended: bool) -> None:
        if self.playback is not None:
            self.playback.seek(t_ns)
            self._show_instant(self.playback.t_ns)
            if has_ended:
                self.bench.note("timeline.seek", t_s=round(self.playback.t_ns / 1e9, 3))

    def _on_zoom(self) -> None:
        self.curves.show_span(self.tracks.from_ns, self.tracks.to_ns)

    def _on_hover(self, t_ns: int | None, object_id: str) -> None:
        if t_ns is None or self.shown is None:
            self.read_out.clear()
            return
        from studio.app.timeline.read_out import read_out

        text = read_out(self.shown, t_ns, object_id, self.bench.document.markers)
        self.read_out.setText(text)

    # --- actions ---------------------------------------------------------------------------------

    def _playing(self) -> Playback:
        if self.playback is None:
            raise ValueError("no recording is open: rehearse, or open a recording first")
        return self.playback

    @property
    def is_open(self) -> bool:
        """Whether a recording can be played."""
        return self.playback is not None

    @property
    def is_compared(self) -> bool:
        """Whether there is a comparison to open as a page."""
        return self.comparison is not None

    def open(self, path: str = "") -> None:
        """Open a recording; without a path, ask for one."""
        from studio.app.timeline.opening import recording_file

        if not path:
            dialog = QFileDialog(self, "Open recording", "", "Recordings (*.mcap)")
            dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            dialog.fileSelected.connect(lambda file: self.bench.do("timeline.open", path=file))
            dialog.open()
            return
        self._opened = None
        self.bench.open_recording(recording_file(Path(path)))

    def play(self) -> None:
        """Play or pause."""
        playback = self._playing()
        if playback.is_playing:
            playback.pause()
        else:
            playback.play()

    def seek(self, t_s: float) -> None:
        """Go to a time of the session, seconds."""
        self._playing().seek(round(float(t_s) * 1e9))
        self._show_instant(self._playing().t_ns)

    def step(self, frames: int) -> None:
        """Go by frames."""
        self._playing().step(frames)

    def jump(self, *, forward: bool) -> None:
        """Go to the next or previous marker or event."""
        marks = [marker.t_ns for marker in self.bench.document.markers]
        if self.shown is not None:
            marks += [event.t_ns for event in self.shown.index.events]
        if not self._playing().jump(marks, forward=forward):
            self.bench.say("info", f"no marker or event {'after' if forward else 'before'} this")

    def to_first_failure(self) -> None:
        """Go to where the tracker fails first."""
        failure = None if self.shown is None else self.shown.failure
        if failure is None:
            self.bench.say("info", "no failure in this recording")
            return
        playback = self._playing()
        playback.pause()
        playback.seek(failure.t_ns)
        self.bench.select(failure.object_id)
        self.bench.say("info", f"{failure.object_id} {failure.text} at {failure.t_ns / 1e9:.2f} s")

    def change_speed(self, steps: int) -> None:
        """Slower or faster."""
        self._playing().change_speed(steps)

    def loop(self) -> None:
        """Begin again at the end, or not."""
        self._playing().is_looping = not self._playing().is_looping

    def switch_curves(self) -> None:
        """Show yaw errors instead of position errors, or the other way round."""
        self.curves.shows_yaw = not self.curves.shows_yaw
        if self.shown is not None:
            self._draw_curves(self.shown)

    def mark(self, text: str = "", t_s: float | None = None) -> None:
        """Add a marker to the document, here unless a time is given."""
        document = self.bench.document
        t_ns = self._playing().t_ns if t_s is None else round(float(t_s) * 1e9)
        marker = Marker(t_ns, text or f"Marker {len(document.markers) + 1}")
        markers = tuple(sorted((*document.markers, marker), key=lambda item: item.t_ns))
        self.bench.change(f"Mark {t_ns / 1e9:.2f} s", replace(document, markers=markers))

    def close_recording(self) -> None:
        """Close it."""
        self.bench.open_recording(None)

    def fork(self, t_s: float | None = None, out: str = "") -> None:
        """Play on from an instant, here unless one is given; the result is B."""
        session, recording = self.bench.session, self.bench.recording
        if session is None or recording is None or self._planning is not None:
            raise ValueError("a fork needs an open recording, and no other fork being planned")
        if session.is_playing:
            raise ValueError("a session is playing already: stop it first")
        at_s = self._playing().t_ns / 1e9 if t_s is None else float(t_s)
        self._forks += 1
        self._fork_out = (
            Path(out)
            if out
            else recording.parent.with_name(f"{recording.parent.name}-fork-{self._forks}")
        )
        self._pair = recording.parent, self._fork_out
        self._playing().pause()
        self._planning = planning_fork(
            recording,
            at_s=at_s,
            document=self.bench.document,
            out=self._fork_out,
            more_faults=tuple(self.bench.offered.faults.values()),
        )

    def _poll_fork(self) -> None:
        task, session = self._planning, self.bench.session
        if task is None or task.is_running or session is None:
            return
        self._planning = None
        if task.result is None:
            self._pair = None
            self.bench.say("error", task.failure or "the fork cannot be planned")
            return
        self.bench.say("info", f"forking into {self._fork_out}: the start is played again first")
        session.play(SceneJob(task.result.scene, task.result, self._fork_out))

    def compare(self, a: str = "", b: str = "") -> None:
        """Compare two folders; without any, the last fork with what it comes from."""
        if not (a and b) and self._pair is None:
            raise ValueError("compare: fork a recording first, or name the folders a and b")
        if self._comparing is not None:
            raise ValueError("compare: two runs are being compared already")
        pair = (Path(a), Path(b)) if a and b else self._pair
        assert pair is not None
        self._comparing = comparing(*pair)

    def open_page(self) -> None:
        """Write the comparison as a page and open it."""
        if self.comparison is not None and self._page is None:
            self._page = writing_page(self.comparison)

    def _poll_comparison(self) -> None:
        task, page = self._comparing, self._page
        if task is not None and not task.is_running:
            self._comparing = None
            if task.result is None:
                self.bench.say("error", task.failure or "the runs cannot be compared")
            else:
                self.comparison = task.result
                self.view.show_comparison(task.result)
                self.pages.setCurrentWidget(self.view)
                self.bench.announce(Topic.RECORDING)
        if page is not None and not page.is_running:
            self._page = None
            if page.result is None:
                self.bench.say("error", page.failure or "the page cannot be written")
            else:
                self.bench.say("info", f"page: {page.result}")
                QDesktopServices.openUrl(QUrl.fromLocalFile(str(page.result)))

    def _leave_comparison(self) -> None:
        self.pages.setCurrentWidget(self.empty if self.playback is None else self._split)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the threads."""
        self._timer.stop()
        tasks: list[Task[Any] | None] = [self._opening, self._planning, self._comparing, self._page]
        for callback in (self._on_recording, self._on_document, self._on_theme, self._on_scene):
            self.bench.stop_listening(callback)
        self._forget()
        for task in tasks:
            if task is not None:
                task.cancel()
                task.join()
        event.accept()
