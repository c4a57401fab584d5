"""The timeline's dock: opens the bench's recording and shows any instant of it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, QTimer, QUrl
from PySide6.QtGui import QCloseEvent, QDesktopServices
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from scenes.package import ScenePackage
from studio.app.model.documents.document import Marker
from studio.app.model.names import shown_name
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.questions import ask_file
from studio.app.shell.theme import THEMES, Theme
from studio.app.timeline.comparison.forking import TwoRuns
from studio.app.timeline.comparison.runs import Runs
from studio.app.timeline.comparison.view import ComparisonView
from studio.app.timeline.empty_page import EmptyPage, TimelinePages
from studio.app.timeline.playback import Playback
from studio.app.timeline.rows import Rows
from studio.app.timeline.transport import Legend, Transport
from studio.app.timeline.viewing import Viewing
from studio.app.viewport.view_grid import ViewGrid

if TYPE_CHECKING:
    from studio.app.timeline.opening import OpenRecording
    from studio.compare.comparison import Comparison

POLL_MS = 15
"""Between two looks at clock and threads: below a frame of a 30 Hz view."""


class TimelineDock(QWidget):
    """Transport buttons, rows over time, error curves; comparisons in the same place.

    Args:
        bench: what it shows and what it calls.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self.bench = bench
        self.viewing = Viewing(bench)
        self.runs = Runs(bench)
        self._build()
        bench.listen(Topic.RECORDING, self._on_recording)
        bench.listen(Topic.DOCUMENT, self._on_document)
        bench.listen(Topic.SETTINGS, self._on_theme)
        bench.listen(Topic.SCENE, self._on_scene)
        bench.listen(Topic.OPENED, self._leave_comparison)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.poll)

    def begin(self) -> None:
        """Show what is open, from now on; the actions are there."""
        self._timer.start(POLL_MS)
        self._on_recording()
        QTimer.singleShot(0, self, self._on_theme)

    @property
    def shown(self) -> OpenRecording | None:
        """The recording that is open."""
        return self.viewing.shown

    @property
    def playback(self) -> Playback | None:
        """Its playhead."""
        return self.viewing.playback

    @property
    def comparison(self) -> Comparison | None:
        """The last comparison."""
        return None if self.runs.compared is None else self.runs.compared.comparison

    # --- construction ----------------------------------------------------------------------------

    def _build(self) -> None:
        self.transport = Transport(self.bench)
        self.rows = Rows(
            self._theme,
            scrub=self._on_scrub,
            hover=self._on_hover,
            choose=self.bench.select,
            name=self.bench.name_of,
        )
        self.tracks, self.curves = self.rows.tracks, self.rows.curves
        self.view = ComparisonView(
            self._leave_comparison,
            partial(self.bench.do, "timeline.open_page"),
            self._on_scrub,
            self._called,
            self._cover,
        )
        self.empty = EmptyPage(self.bench)
        self.pages = TimelinePages()
        for page in (self.empty, self.rows, self.view):
            self.pages.addWidget(page)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(0)
        whole.addWidget(self.transport)
        whole.addWidget(self.pages, 1)
        bottom = QHBoxLayout()
        bottom.setContentsMargins(8, 0, 8, 1)
        self.read_out, self.legend = QLabel(), Legend()
        bottom.addWidget(self.read_out)
        bottom.addWidget(self.legend, 1)
        whole.addLayout(bottom)

    def sizeHint(self) -> QSize:
        """Room for five objects and the curves."""
        return QSize(900, 300)

    def _theme(self) -> Theme:
        return THEMES[self.bench.settings.theme]

    # --- what changes ----------------------------------------------------------------------------

    def _on_theme(self) -> None:
        theme = self._theme()
        self.transport.colour(theme)
        self.legend.colour(theme)
        self.rows.redraw()

    def _on_document(self) -> None:
        self.tracks.show_markers(self.bench.document.markers)  # names may be others, too
        self.view.beside.name_anew()

    def _called(self, item_id: str, *, scene: ScenePackage) -> str:
        return shown_name(item_id, self.bench.document, scene)

    def _on_scene(self) -> None:
        """The scene knows which objects look the same at several yaws: judge errors anew."""
        path = self.viewing.path
        if self.shown is not None and self.bench.scene is not None and path is not None:
            self.viewing.begin(path)

    def _on_recording(self) -> None:
        recording = self.bench.recording
        if recording is None:
            # Two runs can be compared with no recording open: they stay, unless a session plays.
            if self.viewing.path is not None or self.bench.standing.is_session:
                self._forget()
        elif recording != self.viewing.path:
            self._forget()
            self.viewing.path = recording
            self.viewing.begin(recording)
        self._show_buttons()

    def _forget(self) -> None:
        self.viewing.forget()
        self.view.leave()
        self.rows.show_recording(None)
        self.pages.setCurrentWidget(self.empty)
        self.transport.time.clear()
        self.read_out.clear()

    def _show_buttons(self) -> None:
        self.transport.show_available()
        # With two folders it can always be done, by its button only once there was a fork.
        self.transport.buttons["timeline.compare"].setEnabled(self.runs.has_pair)
        self.legend.setVisible(self.pages.currentWidget() is self.rows)

    # --- polling ---------------------------------------------------------------------------------

    def poll(self) -> None:
        """Take what the threads have left; move the playhead."""
        opened = self.viewing.poll()
        if opened is not None:
            self._show(opened)
        share = self.viewing.share
        if share is None:
            self.transport.progress.hide()
        else:
            self.transport.show_share(share)
        compared = self.runs.poll()
        if compared is not None:
            self._show_comparison(compared)
        page = self.runs.take_page()
        if page is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(page)))
        self._show_instant()

    def _show(self, shown: OpenRecording) -> None:
        is_again = self.pages.currentWidget() is not self.empty
        self.bench.open_recording(self.viewing.path)
        self.view.leave()
        self.rows.show_recording(shown)
        self._on_document()
        self.pages.setCurrentWidget(self.rows)
        self.rows.share_height(self.pages.height())
        # Only now can it be played: whoever shows what can be done must look again.
        self.bench.announce(Topic.RECORDING)
        self.bench.remember(str(shown.index.path), "recent_sessions")
        if not is_again and self.runs.is_fork(shown.index.path):
            self.compare()

    def _cover(self, widget: QWidget, is_covered: bool) -> bool:
        """Show something in place of the window's views, or these again; whether there are."""
        grid = self.bench.shared(ViewGrid)
        if grid is not None:
            (grid.cover if is_covered else grid.uncover)(widget)
        return grid is not None

    def _show_comparison(self, compared: TwoRuns) -> None:
        self.view.show_comparison(compared)
        grid, scene = self.bench.shared(ViewGrid), self.bench.scene
        viewer = None if grid is None else grid.active.viewer
        if (
            viewer is not None
            and scene is not None
            and scene.name == compared.comparison.scene.name
        ):
            self.view.beside.look_from(viewer.orbit)
        self.pages.setCurrentWidget(self.view)
        self.bench.announce(Topic.RECORDING)

    def _show_instant(self) -> None:
        playing = self._playhead()
        if playing is None:
            return
        if playing is self.view.playback:
            self.transport.show_time(playing)
            self.view.show_instant()
            if self.viewing.playback is not None:  # all that is seen is of one instant
                self.viewing.playback.seek(playing.t_ns)
                self.viewing.show_instant()
            return
        t_ns = self.viewing.show_instant()
        cut = "" if self.shown is None else self.shown.cut
        self.transport.show_time(playing, self.viewing.other_picture_ns, cut=cut)
        if t_ns is not None:
            self.rows.set_playhead(t_ns)

    def _on_scrub(self, t_ns: int, has_ended: bool) -> None:
        playing = self._playhead()
        if playing is not None:
            playing.seek(t_ns)
            self._show_instant()
            if has_ended:
                self.bench.note("timeline.seek", t_s=round(playing.seconds(playing.t_ns), 3))

    def _on_hover(self, t_ns: int | None, object_id: str) -> None:
        if t_ns is None or self.shown is None:
            self.read_out.clear()
            return
        from studio.app.timeline.read_out import read_out

        markers = self.bench.document.markers
        text = read_out(self.shown, t_ns, object_id, markers=markers, name=self.bench.name_of)
        self.read_out.setText(text)

    # --- actions ---------------------------------------------------------------------------------

    def _playhead(self) -> Playback | None:
        """Of what is in front: the comparison's, or the recording's."""
        is_compared = self.pages.currentWidget() is self.view
        return self.view.playback if is_compared else self.viewing.playback

    def _playing(self) -> Playback:
        playing = self._playhead()
        if playing is None:
            raise ValueError("no recording is open: rehearse, or open a recording first")
        return playing

    @property
    def is_open(self) -> bool:
        """Whether a recording can be played."""
        return self._playhead() is not None

    @property
    def is_compared(self) -> bool:
        """Whether there is a comparison to open as a page."""
        return self.runs.compared is not None

    def open(self, path: str = "") -> None:
        """Open a recording; without a path, ask for one."""
        from studio.app.timeline.opening import recording_file

        chosen = path or ask_file(self, "Open recording", "Recordings (*.mcap)", False)
        if not chosen:
            return
        file = recording_file(Path(chosen))
        if self.bench.standing.is_session:
            raise ValueError(f"{file}: a session is playing: stop it first")
        self.viewing.begin(file)

    def play(self) -> None:
        """Play or pause."""
        playback = self._playing()
        if playback.is_playing:
            playback.pause()
        else:
            playback.play()

    def seek(self, t_s: float) -> None:
        """Go to a time of the session, seconds."""
        playing = self._playing()
        playing.seek(playing.instant_ns(float(t_s)))
        self._show_instant()

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
        name = self.bench.name_of(failure.object_id)
        self.bench.say("info", f"{name} {failure.text} at {playback.seconds(failure.t_ns):.2f} s")

    def change_speed(self, steps: int) -> None:
        """Slower or faster."""
        self._playing().change_speed(steps)

    def loop(self) -> None:
        """Begin again at the end, or not."""
        self._playing().is_looping = not self._playing().is_looping

    def switch_curves(self) -> None:
        """Show yaw errors instead of position errors, or the other way round."""
        self.rows.switch_curves()

    def mark(self, text: str = "", t_s: float | None = None) -> None:
        """Add a marker to the document, here unless a time is given."""
        document = self.bench.document
        playing = self._playing()
        t_ns = playing.t_ns if t_s is None else playing.instant_ns(float(t_s))
        marker = Marker(t_ns, text or f"Marker {len(document.markers) + 1}")
        markers = tuple(sorted((*document.markers, marker), key=lambda item: item.t_ns))
        self.bench.change(f"Mark {playing.seconds(t_ns):.2f} s", replace(document, markers=markers))

    def close_recording(self) -> None:
        """Close it."""
        self.bench.open_recording(None)

    def fork(self, t_s: float | None = None, out: str = "", anyway: bool = False) -> None:
        """Play on from an instant, here unless one is given; the result is B."""
        at_s = self._playing().t_ns / 1e9 if t_s is None else float(t_s)
        self.runs.fork(at_s, out, anyway=anyway)
        self._playing().pause()

    def compare(self, a: str = "", b: str = "") -> None:
        """Compare two folders; without any, the last fork with what it comes from."""
        self.runs.compare(a, b)

    def open_page(self) -> None:
        """Write the comparison as a page and open it."""
        self.runs.write_page()

    def _leave_comparison(self) -> None:
        if self.pages.currentWidget() is not self.view:
            return
        self.view.leave()
        self.pages.setCurrentWidget(self.empty if self.playback is None else self.rows)
        self.bench.announce(Topic.RECORDING)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the threads."""
        self._timer.stop()
        for callback in (
            self._on_recording,
            self._on_document,
            self._on_theme,
            self._on_scene,
            self._leave_comparison,
        ):
            self.bench.stop_listening(callback)
        self.empty.leave()
        self.viewing.close()
        self.runs.close()
        self.view.close()
        event.accept()
