"""The main window: the view, its docks, menus, and what it says at the bottom."""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QByteArray, QTimer
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow, QStatusBar, QVBoxLayout, QWidget

from studio.app.model.runs.guests import Guests
from studio.app.model.runs.leaving import Answer, Leaving, Replacing, document_name
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.runs.session_run import SessionRun
from studio.app.model.settings import save_settings
from studio.app.model.workbench import Topic, Workbench
from studio.app.plugins.panel_docks import PanelDocks
from studio.app.plugins.plugin_host import PluginHost
from studio.app.shell.actions.files import FileActions
from studio.app.shell.actions.live import LiveActions
from studio.app.shell.actions.people import GuestActions
from studio.app.shell.actions.sessions import add_session_actions
from studio.app.shell.actions.window import add_shell_actions
from studio.app.shell.docking.window_docks import WindowDocks
from studio.app.shell.first_page import FirstPage
from studio.app.shell.history import QtHistory
from studio.app.shell.keys.cheat_sheet import CheatSheet
from studio.app.shell.keys.command_palette import CommandPalette
from studio.app.shell.keys.single_keys import SingleKeys
from studio.app.shell.menus import Menus
from studio.app.shell.notice import NoticeBar
from studio.app.shell.questions import ask_file, ask_folder, ask_unsaved
from studio.app.shell.script_run import ScriptRun
from studio.app.shell.share_dialog import ask_share
from studio.app.shell.theme import SHAPES, THEMES, apply_theme
from studio.app.shell.window_film import WindowFilm
from studio.app.shell.work_in_progress import WorkInProgress

POLL_MS = 15
"""Between two looks at what the threads have left: well below a frame of a 30 Hz view."""


class StatusLine:
    """Follows the bench.

    Args:
        bench: whose log and session are shown.
        run: plays the sessions.
        bar: where it is shown.
    """

    def __init__(self, bench: Workbench, run: SessionRun, bar: QStatusBar) -> None:
        self._bench, self._run = bench, run
        self._line, self._state, self._count = QLabel("opening …"), QLabel(), QLabel()
        bar.addWidget(self._line, 1)
        bar.addPermanentWidget(self._count)
        bar.addPermanentWidget(self._state)
        bench.listen(Topic.SESSION, self._on_session)
        bench.listen(Topic.RECORDING, self._on_session)
        bench.listen(Topic.LOG, self._on_log)
        bench.listen(Topic.DOCUMENT, self._on_change)

    @property
    def text(self) -> str:
        """The line."""
        return self._line.text()

    def say(self, text: str) -> None:
        """Show a line that is in no log."""
        self._line.setText(text)

    def _on_session(self) -> None:
        run = self._run
        self._line.setText(run.line)
        text = ""  # the time of a recording stands over the timeline, and nowhere else
        if run.is_playing and run.output is not None:
            frame = run.output.input.frame
            text = f"{frame.t_ns / 1e9:6.1f} s   frame {frame.seq:5d}"
        self._count.setText(text)
        kind = "good" if run.is_playing else "calm"
        words = str(self._bench.standing.mode) if not run.is_opening else "opening"
        self._state.setText(f"{SHAPES[kind]} {words}")

    def _on_change(self) -> None:
        """Something was done since: what could not be done before is over."""
        lines = self._bench.log.lines()
        if lines and lines[-1].level == "error" and lines[-1].text in self._line.text():
            self._line.setText(self._run.line)

    def _on_log(self) -> None:
        line = self._bench.log.lines()[-1]
        shape = {"info": "", "warning": "▲ ", "error": "✖ "}[line.level]
        self._line.setText(shape + line.text)
        self._line.setToolTip(line.text)


class MainWindow(QMainWindow):
    """The studio's window. Closing it stops what is running and waits for it.

    Args:
        bench: what it shows.
        run: plays the bench's sessions.
        home: folder of settings and of work in progress.
        make_view: makes the view in the middle.
        plugins: folder of plug-ins; None for the user's.
    """

    def __init__(
        self,
        bench: Workbench,
        run: SessionRun,
        *,
        home: Path,
        make_view: Callable[[Workbench], QWidget],
        plugins: Path | None = None,
    ) -> None:
        super().__init__()
        self.bench, self.run = bench, run
        self.script: ScriptRun | None = None
        self.after_script: Callable[[], object] | None = None
        self._home = home
        self._make_view = make_view
        self._film: WindowFilm | None = None
        self._known_actions = 0
        self.view: QWidget | None = None
        self._wear_theme()  # docks take the height of their tabs from it when they are made
        self.setAcceptDrops(True)
        self.resize(1380, 860)
        self.setMinimumSize(860, 560)
        self.notice, self.problem = NoticeBar(), NoticeBar()
        self._is_asked = False
        self.leaving = Leaving(bench, self._ask_unsaved, lambda: bench.do("file.save"))
        replacing = Replacing(bench, run, self.leaving)
        self._work = WorkInProgress(bench, home, self.notice, replacing)
        middle = QWidget()
        self._middle = QVBoxLayout(middle)
        self._middle.setContentsMargins(0, 0, 0, 0)
        self._middle.setSpacing(0)
        self.problem.follow(bench)
        for bar in (self.notice, self.problem):
            self._middle.addWidget(bar)
        self._docks = WindowDocks(self, bench, middle, filled=self._show_content)
        self.docks = self._docks.widgets
        self._panels = PanelDocks(self._docks.manager, self.docks["session"])
        self.plugins = PluginHost(bench, plugins or home / "plugins", places=self._panels)
        self._single_keys = SingleKeys(self, self._docks.manager)
        self.menus = Menus(bench, self)
        self.palette_bar = CommandPalette(bench, self)
        self.cheat_sheet = CheatSheet(bench, self)
        self._status = StatusLine(bench, run, self.statusBar())
        self.first_page: FirstPage | None = None
        ask = partial(ask_file, self)
        FileActions(bench, replacing, ask, partial(ask_folder, self)).add()
        add_session_actions(bench, run, partial(ask_share, self))
        live, guests = bench.shared(LiveRun), bench.shared(Guests)
        if live is not None and guests is not None:
            LiveActions(bench, live, ask).add()
            GuestActions(bench, guests).add()
        add_shell_actions(bench, self)
        self.menus.build()
        self._listen()
        self._restore()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._poll)
        self._timer.start(POLL_MS)
        # The window is on the screen before the view and the docks are made.
        QTimer.singleShot(0, self, self._fill)

    # --- construction ----------------------------------------------------------------------------

    def _fill(self) -> None:
        if not self._timer.isActive():
            return  # closed before it was filled
        if not self.bench.settings.layout:
            self._docks.lower_timeline()
        self.view = self._make_view(self.bench)
        self._middle.addWidget(self.view, 1)
        self.menus.build()
        self._recolour()
        if not self.bench.settings.has_started:
            self.show_first_page()
        self._work.offer()
        self.plugins.start()
        self._docks.begin_filling()

    def _show_content(self) -> None:
        self.menus.build()
        self._recolour()

    @property
    def line(self) -> str:
        """The line at the bottom of the window."""
        return self._status.text

    def content(self, dock_id: str) -> QWidget:
        """Return the content of a dock; made if it was not yet."""
        return self._docks.content(dock_id)

    def _listen(self) -> None:
        self.bench.listen(Topic.DOCUMENT, self._on_document)
        self.bench.listen(Topic.SCENE, self._on_document)
        for topic in (Topic.SESSION, Topic.RECORDING, Topic.SELECTION):
            self.bench.listen(topic, self.menus.refresh)
        self.bench.listen(Topic.SETTINGS, self._on_settings)
        if isinstance(self.bench.history, QtHistory):  # steps come after their documents
            self.bench.history.stack.indexChanged.connect(self._on_document)
        self._on_document()
        self._on_settings()

    def _stop_listening(self) -> None:
        """Hear of no change any more: menus and title are about to go."""
        for callback in (self.menus.refresh, self._on_document, self._on_settings):
            self.bench.stop_listening(callback)
        if isinstance(self.bench.history, QtHistory):
            self.bench.history.stack.indexChanged.disconnect(self._on_document)

    # --- what changes ----------------------------------------------------------------------------

    def _on_document(self) -> None:
        name = document_name(self.bench)
        self.setWindowTitle(f"{name}{'' if self.bench.is_saved else ' •'} - GaussianNexus Studio")
        self.menus.refresh()

    def _on_settings(self) -> None:
        settings = self.bench.settings
        if self._wear_theme() and self.view is not None:
            self._recolour()
        self.menus.refresh()
        try:
            save_settings(settings, self._home / "settings.json")
        except OSError as error:
            self._status.say(f"▲ settings cannot be saved: {error.strerror}")

    def _wear_theme(self) -> bool:
        """Give the application the user's theme; whether it had another one."""
        application = QApplication.instance()
        if not isinstance(application, QApplication):
            return False
        wanted = (self.bench.settings.theme, self.bench.settings.text_scale)
        if application.property("nexus theme") == repr(wanted):
            return False
        apply_theme(application, *wanted)
        application.setProperty("nexus theme", repr(wanted))
        return True

    def _recolour(self) -> None:
        theme = THEMES[self.bench.settings.theme]
        self.menus.colour(theme.text)
        self._panels.colour(theme.text)
        self._docks.colour(theme)

    def _poll(self) -> None:
        self.run.poll()
        guests = self.bench.shared(Guests)
        if guests is not None:
            guests.poll()
        self.plugins.poll()
        if self._known_actions != len(self.bench.actions):
            self._known_actions = len(self.bench.actions)
            self.menus.build()
        self._work.poll()
        if self.script is None:
            return
        if not self.script.is_done:
            self.script.advance()
        elif self.after_script is not None:
            after, self.after_script = self.after_script, None
            after()

    @property
    def is_filled(self) -> bool:
        """Whether the view and all docks are there."""
        return self.view is not None and self._docks.are_filled

    # --- what the actions ask for ----------------------------------------------------------------

    def show_palette(self) -> None:
        """See `Shell`."""
        self.palette_bar.open()

    def show_keys(self) -> None:
        """See `Shell`."""
        self.cheat_sheet.open()

    def show_dock(self, dock_id: str) -> None:
        """See `Shell`."""
        self._docks.show(dock_id)

    def save_layout(self, name: str) -> None:
        """See `Shell`."""
        self._docks.save_layout(name)

    def load_layout(self, name: str) -> None:
        """See `Shell`."""
        self._docks.load_layout(name)

    def save_picture(self, path: Path) -> None:
        """See `Shell`."""
        path.parent.mkdir(parents=True, exist_ok=True)
        if not self.grab().save(str(path)):
            raise OSError(
                f"{path}: the picture cannot be written; wanted a name such as studio.png"
            )
        self.bench.say("info", f"saved {path}")

    def film_window(self, path: Path | None) -> None:
        """See `Shell`."""
        if self._film is not None:
            film, self._film = self._film, None
            film.stop()
            self.bench.say("info", f"saved {film.path}")
        if path is not None:
            self._film = WindowFilm(self, path)

    def resize_to(self, width_px: int, height_px: int) -> None:
        """See `Shell`."""
        self.resize(width_px, height_px)

    def close_window(self) -> None:
        """See `Shell`."""
        self.leaving.then(self.close)

    def close(self) -> bool:
        """Close without a question: unsaved work stays kept, and is offered again."""
        self._is_asked = True
        return super().close()

    def _ask_unsaved(self, name: str, answered: Callable[[Answer], None]) -> None:
        if self.script is not None and not self.script.is_done:
            answered(Answer.KEEP)  # a script can answer no question
        else:
            ask_unsaved(self, name, answered)

    def show_first_page(self) -> None:
        """See `Shell`."""
        if self.view is not None:
            if self.first_page is not None:
                self.first_page.leave()
            self.first_page = FirstPage(self.bench, self.view)
            self.first_page.begin()

    # --- layout, closing -------------------------------------------------------------------------

    def _restore(self) -> None:
        settings = self.bench.settings
        if settings.geometry:
            self.restoreGeometry(QByteArray(base64.b64decode(settings.geometry)))
        if settings.layout:
            self._docks.manager.restoreState(QByteArray(base64.b64decode(settings.layout)))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        if self.first_page is not None and self.first_page.isVisible():
            QTimer.singleShot(0, self, self.first_page.place)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """See Qt."""
        if event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """See Qt."""
        paths = [url.toLocalFile() for url in event.mimeData().urls() if url.isLocalFile()]
        self.bench.do("file.drop", paths=paths)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask about unsaved work; remember the layout, stop what runs, wait for the threads."""
        if not self._is_asked:
            event.ignore()
            self.close_window()
            return
        self._timer.stop()
        self._docks.stop_filling()
        self.film_window(None)
        layout = base64.b64encode(bytes(self._docks.manager.saveState().data())).decode()
        geometry = base64.b64encode(bytes(self.saveGeometry().data())).decode()
        self.bench.set(layout=layout, geometry=geometry)
        self._stop_listening()
        self.hide()  # at once, also where the session takes a while to stop
        self.run.close()
        self.plugins.close()
        for widget in (self.view, *self._docks.contents.values()):
            if widget is not None:
                widget.close()
        self._work.close()
        event.accept()
