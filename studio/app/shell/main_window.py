"""The main window: the view, its docks, menus, and what it says at the bottom."""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import PySide6QtAds as ads
from PySide6.QtCore import QByteArray, QTimer
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow, QVBoxLayout, QWidget

from studio.app.model.runs.leaving import Answer, Leaving, Replacing, document_name
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.runs.session_run import SessionRun
from studio.app.model.settings import save_settings
from studio.app.model.workbench import Topic, Workbench
from studio.app.plugins.panel_docks import PanelDocks
from studio.app.plugins.plugin_host import PluginHost
from studio.app.shell.actions.files import add_file_actions
from studio.app.shell.actions.live import LiveActions
from studio.app.shell.actions.sessions import add_session_actions
from studio.app.shell.actions.window import add_shell_actions
from studio.app.shell.docking.docks import CLOSED_AT_FIRST, DOCKS, Dock, make_content
from studio.app.shell.docking.layouts import AREAS, FIRST_SHARES, Layout, add_dock_again
from studio.app.shell.docking.timeline_height import TimelineHeight
from studio.app.shell.first_page import FirstPage
from studio.app.shell.history import QtHistory
from studio.app.shell.keys.cheat_sheet import CheatSheet
from studio.app.shell.keys.command_palette import CommandPalette
from studio.app.shell.keys.single_keys import VIEW, SingleKeys
from studio.app.shell.menus import Menus
from studio.app.shell.notice import NoticeBar
from studio.app.shell.questions import ask_file, ask_folder, ask_unsaved
from studio.app.shell.script_run import ScriptRun
from studio.app.shell.share_dialog import ask_share
from studio.app.shell.status_line import StatusLine
from studio.app.shell.theme import THEMES, apply_theme
from studio.app.shell.window_film import WindowFilm
from studio.app.shell.work_in_progress import WorkInProgress

POLL_MS = 15
"""Between two looks at what the threads have left: well below a frame of a 30 Hz view."""


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
        self._contents: dict[str, QWidget] = {}
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
        self._docks, self.docks = self._make_docks(middle)
        self._panels = PanelDocks(self._docks, self.docks["session"])
        self.plugins = PluginHost(bench, plugins or home / "plugins", places=self._panels)
        self._single_keys = SingleKeys(self, self._docks)
        self._first_layout = Layout(bytes(self._docks.saveState().data()), FIRST_SHARES)
        self._timeline_height = TimelineHeight(bench, self.docks["timeline"])
        self.menus = Menus(bench, self)
        self.palette_bar = CommandPalette(bench, self)
        self.cheat_sheet = CheatSheet(bench, self)
        self._status = StatusLine(bench, run, self.statusBar())
        self.first_page: FirstPage | None = None
        ask = partial(ask_file, self)
        add_file_actions(bench, replacing, ask, partial(ask_folder, self))
        add_session_actions(bench, run, partial(ask_share, self))
        live = bench.shared(LiveRun)
        if live is not None:
            LiveActions(bench, live, ask).add()
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

    def _make_docks(self, middle: QWidget) -> tuple[Any, dict[str, Any]]:
        flags = ads.CDockManager.eConfigFlag
        ads.CDockManager.setConfigFlag(flags.OpaqueSplitterResize, True)
        ads.CDockManager.setConfigFlag(flags.FocusHighlighting, False)
        ads.CDockManager.setConfigFlag(flags.DockAreaHasTabsMenuButton, False)
        # The application's theme decides, also after a change of theme.
        ads.CDockManager.setConfigFlag(flags.DisableStylesheet, True)
        # A floating dock is dragged back by a title bar of the library's own: it sees no drags of
        # a window manager's.
        ads.CDockManager.setConfigFlag(flags.FloatingContainerForceQWidgetTitleBar, True)
        manager = ads.CDockManager(self)
        add_dock_again(manager)
        centre = ads.CDockWidget(manager, VIEW)
        centre.setWidget(middle)
        centre.setFeature(ads.CDockWidget.DockWidgetFeature.NoTab, True)
        areas = {"centre": manager.setCentralWidget(centre)}
        made: dict[str, Any] = {}
        for dock in DOCKS:
            widget = ads.CDockWidget(manager, dock.title)
            widget.setObjectName(dock.id)
            widget.setWidget(QWidget())
            widget.setMinimumSizeHintMode(
                ads.CDockWidget.eMinimumSizeHintMode.MinimumSizeHintFromDockWidget
            )
            widget.visibilityChanged.connect(lambda _=False, of=dock: self._fill_dock(of))
            if dock.side in areas:
                manager.addDockWidgetTabToArea(widget, areas[dock.side])
            else:
                areas[dock.side] = manager.addDockWidget(AREAS[dock.side], widget)
            made[dock.id] = widget
        for side in ("left", "right"):
            first = next(made[dock.id] for dock in DOCKS if dock.side == side)
            first.setAsCurrentTab()
        for dock_id in CLOSED_AT_FIRST:
            made[dock_id].toggleView(False)
        manager.setSplitterSizes(areas["left"], [250, 640, 490])
        manager.setSplitterSizes(areas["bottom"], [540, 260])
        return manager, made

    def _fill(self) -> None:
        if not self._timer.isActive():
            return  # closed before it was filled
        if not self.bench.settings.layout:
            self._timeline_height.lower()
        self.view = self._make_view(self.bench)
        self._middle.addWidget(self.view, 1)
        self.menus.build()
        self._recolour()
        if not self.bench.settings.has_started:
            self.show_first_page()
        self._work.offer()
        self.plugins.start()
        QTimer.singleShot(0, self, self._fill_docks)

    def _fill_docks(self) -> None:
        """Make one dock's content at a time, those that are seen first."""
        order = sorted(DOCKS, key=lambda dock: not self.docks[dock.id].isVisible())
        missing = [dock for dock in order if dock.id not in self._contents]
        if missing and self._timer.isActive():
            self._make_content(missing[0])
            QTimer.singleShot(30, self, self._fill_docks)

    def _fill_dock(self, dock: Dock) -> None:
        if self.view is not None and self.docks[dock.id].isVisible():
            self._make_content(dock)

    def _make_content(self, dock: Dock) -> None:
        if dock.id in self._contents:
            return
        content = make_content(dock, self.bench)
        self._contents[dock.id] = content
        before = self.docks[dock.id].takeWidget()
        self.docks[dock.id].setWidget(content)
        before.deleteLater()
        self.menus.build()
        self._recolour()

    @property
    def line(self) -> str:
        """What the bottom of the window says."""
        return self._status.text

    def content(self, dock_id: str) -> QWidget:
        """What a dock holds; made if it was not yet."""
        self._make_content(next(dock for dock in DOCKS if dock.id == dock_id))
        return self._contents[dock_id]

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
        import qtawesome  # loads fonts: not before the window is shown

        theme = THEMES[self.bench.settings.theme]
        self.menus.colour(theme.text)
        self._panels.colour(theme.text)
        for dock in DOCKS:
            self.docks[dock.id].setIcon(qtawesome.icon(dock.icon, color=theme.faint))
            # The docks' library colours its tabs by itself, unreadably in a dark theme.
            for label in self.docks[dock.id].tabWidget().findChildren(QLabel):
                label.setStyleSheet(f"color: {theme.text}")

    def _poll(self) -> None:
        self.run.poll()
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
        return self.view is not None and len(self._contents) == len(DOCKS)

    # --- what the actions ask for ----------------------------------------------------------------

    def show_palette(self) -> None:
        """See `Shell`."""
        self.palette_bar.open()

    def show_keys(self) -> None:
        """See `Shell`."""
        self.cheat_sheet.open()

    def show_dock(self, dock_id: str) -> None:
        """See `Shell`."""
        self.docks[dock_id].toggleView(True)
        self.docks[dock_id].setAsCurrentTab()
        self.content(dock_id).setFocus()

    def save_layout(self, name: str) -> None:
        """See `Shell`."""
        layout = Layout.of(self._docks).text()
        self.bench.set(layouts={**self.bench.settings.layouts, name: layout})

    def load_layout(self, name: str) -> None:
        """See `Shell`."""
        if not name:
            self._first_layout.show(self._docks)
            self._timeline_height.lower()
            return
        layout = self.bench.settings.layouts.get(name)
        if layout is None:
            known = ", ".join(self.bench.settings.layouts) or "none"
            raise ValueError(f"no layout {name!r}; saved are: {known}")
        Layout.from_text(layout).show(self._docks)

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
            self._docks.restoreState(QByteArray(base64.b64decode(settings.layout)))

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
        self.film_window(None)
        layout = base64.b64encode(bytes(self._docks.saveState().data())).decode()
        geometry = base64.b64encode(bytes(self.saveGeometry().data())).decode()
        self.bench.set(layout=layout, geometry=geometry)
        self.hide()  # at once, also where the session takes a while to stop
        self.run.close()
        self.plugins.close()
        for widget in (self.view, *self._contents.values()):
            if widget is not None:
                widget.close()
        self._work.close()
        event.accept()


def make_history(bench_document: Callable[[], Workbench]) -> QtHistory:
    """The undo stack of a bench that is made after it."""
    return QtHistory(lambda document: bench_document().show_document(document))
