"""The session panel: devices, tracker, checks, times, log and report."""

from __future__ import annotations

import time
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, QUrl
from PySide6.QtGui import QCloseEvent, QColor, QDesktopServices, QGuiApplication
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QTabWidget,
    QTextBrowser,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from devices.streams import Slot
from scenes.workers.task import Task
from studio.app.devices.checks_table import KINDS, VERDICTS, ChecksTable
from studio.app.devices.latency_bar import LatencyBar
from studio.app.devices.report_html import browser_page, report_page
from studio.app.devices.tracker_options import TrackerPanel
from studio.app.model.actions import Action
from studio.app.model.settings import settings_folder
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.theme import SHAPES, THEMES, figures
from studio.session.preflight import Check, checks_for, run_checks, save_checks, worst

POLL_MS = 250
STALE_S = 1.0
"""Seconds without a frame after which a camera that plays is no longer good."""
SHOWN_FRAMES = 600
"""Newest frames whose times are shown, chosen: a minute at 10 Hz."""
NUMBERS = (2, 3, 4)
"""Columns of the devices that hold numbers: at the right, under one another."""
DEVICE_LINES = 4
"""The heading, and the devices."""
_AT_THE_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
LEVELS = {"info": "calm", "warning": "warning", "error": "bad"}


class SessionDock(QWidget):
    """Devices, tracker, checks before the start, delays, log and report, in tabs.

    Args:
        bench: whose session and log are shown.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self._checks: Slot[list[Check]] = Slot()
        self._checker: Task[None] | None = None
        self._last: tuple[int, float] = (-1, 0.0)
        self._rate: tuple[int, float, float] = (0, 0.0, 0.0)
        self._shown_report: Path | None = None
        self.tabs = QTabWidget()
        self.tabs.addTab(self._make_devices(), "Devices")
        self.tabs.addTab(self._make_tracker(), "Tracker")
        self.tabs.addTab(self._make_checks(), "Checks")
        self.tabs.addTab(self._make_log(), "Log")
        self.tabs.addTab(self._make_report(), "Report")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.tabs)
        if "session.check" not in bench.actions:
            hint = "look at camera, tracker, disk, clock, drawing and memory"
            bench.actions.add(
                Action("session.check", "Check before the start", "Session", self.check, hint)
            )
        bench.listen(Topic.LOG, self._show_log)
        bench.listen(Topic.RECORDING, self._show_report)
        bench.listen(Topic.SETTINGS, self._show_log)
        self._show_log()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.refresh)
        self._timer.start(POLL_MS)
        self.refresh()

    def _make_devices(self) -> QWidget:
        self.devices = _table(["Device", "State", "Last frame", "Rate", "Lost"])
        self.devices.setFixedHeight(DEVICE_LINES * (self.fontMetrics().lineSpacing() + 8))
        self.devices.header().setStretchLastSection(False)
        self.devices.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column in NUMBERS:
            self.devices.headerItem().setTextAlignment(column, _AT_THE_RIGHT)
        self.latency = LatencyBar()
        page, layout = _page()
        layout.addWidget(self.devices)
        layout.addWidget(QLabel("Time per frame by stage"))
        layout.addWidget(self.latency)
        layout.addStretch(1)
        return page

    def _make_tracker(self) -> QWidget:
        self.tracker = TrackerPanel(self._bench)
        page, layout = _page()
        layout.addWidget(self.tracker)
        layout.addStretch(1)
        return page

    def _make_checks(self) -> QWidget:
        self.check_button = QPushButton("Check now")
        self.check_button.clicked.connect(lambda: self._bench.do("session.check"))
        self.checks_line = QLabel("Looks at camera, tracker, disk, clock, drawing and memory.")
        self.checks_line.setWordWrap(True)
        self.checks = ChecksTable()
        row = QHBoxLayout()
        row.addWidget(self.check_button)
        row.addWidget(self.checks_line, 1)
        page, layout = _page()
        layout.addLayout(row)
        layout.addWidget(self.checks, 1)
        return page

    def _make_log(self) -> QWidget:
        self.level = QComboBox()
        self.level.addItems(["info", "warning", "error"])
        self.level.setToolTip("the least that is shown")
        self.level.setAccessibleName("Least level shown")
        self.level.currentTextChanged.connect(self._show_log)
        self.search = QLineEdit()
        self.search.setPlaceholderText("Search the log")
        self.search.setClearButtonEnabled(True)
        self.search.textChanged.connect(self._show_log)
        copy = QPushButton("Copy")
        copy.clicked.connect(self.copy_log)
        folder = QPushButton("Open folder")
        folder.clicked.connect(lambda: _open(settings_folder()))
        row = QHBoxLayout()
        row.addWidget(self.level)
        row.addWidget(self.search, 1)
        row.addWidget(copy)
        row.addWidget(folder)
        self.log_empty = QLabel()
        self.log_empty.setObjectName("faint")
        self.log = QListWidget()
        self.log.setWordWrap(True)
        self.log.setSelectionMode(QListWidget.SelectionMode.ExtendedSelection)
        page, layout = _page()
        layout.addLayout(row)
        layout.addWidget(self.log_empty, 1, Qt.AlignmentFlag.AlignCenter)
        layout.addWidget(self.log, 1)
        return page

    def _make_report(self) -> QWidget:
        self.report = QTextBrowser()
        self.report.setOpenLinks(False)
        self.report.setHtml("<p>No report yet: rehearse (F5), or open a rehearsal's recording.</p>")
        self.browser_button = QPushButton("Open in browser")
        self.browser_button.setEnabled(False)
        self.browser_button.clicked.connect(self._open_report)
        page, layout = _page()
        layout.addWidget(self.report, 1)
        layout.addWidget(self.browser_button)
        return page

    # --- checks ----------------------------------------------------------------------------------

    def check(self) -> None:
        """Begin to look at everything; the list comes when it is done."""
        if self._checker is not None and self._checker.is_running:
            return
        self.checks_line.setText("checking …")
        self.check_button.setEnabled(False)
        run = self._bench.session
        folder = (settings_folder() / "rehearsals") if run is None else run.out.parent
        self._checker = Task(
            "checks", lambda _: self._checks.put(run_checks(checks_for(recordings=folder)))
        ).start()

    def _show_checks(self, checks: list[Check]) -> None:
        self.check_button.setEnabled(True)
        self.checks.show_checks(checks, THEMES[self._bench.settings.theme])
        verdict = worst(checks)
        self.checks_line.setText(f"{SHAPES[KINDS[verdict]]} {VERDICTS[verdict]}")
        try:
            save_checks(checks, settings_folder() / "preflight.json")
        except OSError as error:
            self._bench.say("warning", f"the checks cannot be saved: {error}")

    # --- what goes on ----------------------------------------------------------------------------

    def refresh(self) -> None:
        """Show what the session and the checks have come to since."""
        checks = self._checks.take()
        if checks is not None:
            self._show_checks(checks)
        run = self._bench.session
        session = None if run is None or run.job is None else run.job.session
        playing = run is not None and run.is_playing
        now = time.monotonic()
        tracked = waiting = lost = 0
        if session is not None:
            tracked, waiting, lost = session.counts
            self.latency.show_stages(
                [s for s in session.latencies.stages(last=SHOWN_FRAMES) if s.name != "track"]
            )
        if tracked != self._last[0]:
            self._last = tracked, now
        before, at, fps = self._rate
        if tracked < before or now - at >= 1.0:
            fps = max(tracked - before, 0) / max(now - at, 1e-3) if at else 0.0
            self._rate = tracked, now, fps
        age_s = now - self._last[1]
        kind, words = ("calm", "idle") if session is None or not playing else ("good", "plays")
        if playing and (not tracked or age_s > STALE_S):
            kind, words = "warning", "waits"
        age = f"{figures(age_s, '6.1f')} s" if tracked and playing else "–"
        rate = f"{figures(fps, '5.1f')} /s" if playing else "–"
        self._show_devices(
            [
                ("Camera", kind, words, age, rate, f"{waiting + lost}"),
                ("Tracker", kind, words, age, rate, f"{waiting}"),
                ("Recorder", kind, "writes" if playing else "idle", "–", "–", "–"),
            ]
        )

    def _show_devices(self, rows: list[tuple[str, str, str, str, str, str]]) -> None:
        while self.devices.topLevelItemCount() < len(rows):
            self.devices.addTopLevelItem(QTreeWidgetItem())
        for place, (name, kind, words, *numbers) in enumerate(rows):
            item = self.devices.topLevelItem(place)
            assert item is not None
            for column, text in enumerate([name, f"{SHAPES[kind]} {words}", *numbers]):
                item.setText(column, text)
                if column in NUMBERS:
                    item.setTextAlignment(column, _AT_THE_RIGHT)
            item.setForeground(1, self._colour(kind))

    def _show_log(self) -> None:
        level = self.level.currentText()
        typed = self.search.text().lower()
        assert level in ("info", "warning", "error")
        self.log.clear()
        for line in self._bench.log.lines(level)[-500:]:
            if typed in line.text.lower():
                clock = time.strftime("%H:%M:%S", time.localtime(line.t_ns / 1e9))
                kind = LEVELS[line.level]
                item = QListWidgetItem(f"{clock} {SHAPES[kind]} {line.text}")
                if line.level != "info":
                    item.setForeground(self._colour(kind))
                self.log.addItem(item)
        nothing = "Nothing that fits." if typed or level != "info" else "Nothing was reported yet."
        self.log_empty.setText(nothing)
        self.log_empty.setVisible(not self.log.count())
        self.log.setVisible(bool(self.log.count()))
        self.log.scrollToBottom()

    def copy_log(self) -> None:
        """Put the lines that are selected, or all that are shown, on the clipboard."""
        chosen = self.log.selectedItems() or [self.log.item(row) for row in range(self.log.count())]
        QGuiApplication.clipboard().setText("\n".join(item.text() for item in chosen))

    def _show_report(self) -> None:
        recording = self._bench.recording
        folder = None if recording is None else recording.parent
        if folder is None or folder == self._shown_report:
            return
        self._shown_report = folder
        self.report.setHtml(report_page(folder, self._bench.name_of))
        self.browser_button.setEnabled(browser_page(folder).is_file())

    def _open_report(self) -> None:
        if self._shown_report is not None:
            _open(browser_page(self._shown_report))

    def closeEvent(self, event: QCloseEvent) -> None:
        """No longer follow the bench: the window closes."""
        self._timer.stop()
        self.tracker.close_panel()
        for callback in (self._show_log, self._show_report):
            self._bench.stop_listening(callback)
        event.accept()

    def _colour(self, kind: str) -> QColor:
        return QColor(getattr(THEMES[self._bench.settings.theme], kind))


def _page() -> tuple[QWidget, QVBoxLayout]:
    page = QWidget()
    layout = QVBoxLayout(page)
    layout.setContentsMargins(8, 8, 8, 8)
    return page, layout


def _table(titles: list[str]) -> QTreeWidget:
    table = QTreeWidget()
    table.setHeaderLabels(titles)
    table.setRootIsDecorated(False)
    table.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    table.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
    table.header().setStretchLastSection(True)
    return table


def _open(path: Path) -> None:
    QDesktopServices.openUrl(QUrl.fromLocalFile(str(path)))
