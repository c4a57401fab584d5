"""The live panel: from the first check to the report with one button, and how it goes."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QTimer, QUrl
from PySide6.QtGui import QCloseEvent, QDesktopServices
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QTabWidget,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)

from studio.app.devices.checks_table import KINDS, VERDICTS, ChecksTable
from studio.app.devices.latency_bar import LatencyBar
from studio.app.devices.report_html import browser_page, report_page
from studio.app.devices.tracker_options import TrackerOptionsForm
from studio.app.live.camera_page import CameraPage
from studio.app.live.camera_view import CameraView
from studio.app.live.head import LiveHead
from studio.app.live.headset_page import HeadsetPage
from studio.app.live.quest_page import QuestPage
from studio.app.live.words import banner_of
from studio.app.model.jobs.live_job import LiveJob
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.theme import SHAPES, THEMES
from studio.live.status import LiveState
from studio.session.preflight import worst

POLL_MS = 200
"""Between two looks at the session: 5 Hz, as often as its picture is drawn anew."""

MIN_PAGE_PX = 90
"""Height below which a page is not worth showing, chosen."""

TABS = {"confirming": "Camera", "refused": "Camera", "live": "Delay"}
"""Tab that comes to the front with a state, once."""

NO_DELAYS = "Go live to see how long each step takes."
NO_CHECKS = "Nothing was checked yet."
NO_REPORT = "<p>No report yet: it opens when a live session has ended.</p>"


class LiveDock(QWidget):
    """State and button on top, the camera's picture and figures below, the rest in tabs.

    Args:
        bench: whose live session it is.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        live = bench.shared(LiveRun)
        assert live is not None, "made with the window"
        self._bench, self.live = bench, live
        self._job: LiveJob | None = None
        self._state = LiveState.ENDED
        self._shown_report: Path | None = None
        self.head = LiveHead(bench, self.live)
        self.camera = CameraView(bench)
        self.tabs = QTabWidget()
        self.page = CameraPage(bench, self.live)
        self.headset = HeadsetPage(bench, self.live)
        self.quest = QuestPage(bench, self.live)
        self.tabs.addTab(_scrolled(self.page), "Camera")
        self.tabs.addTab(_scrolled(self.headset), "HoloLens")
        self.tabs.addTab(_scrolled(self.quest), "Quest")
        self.tabs.addTab(self._make_checks(), "Checks")
        self.tabs.addTab(_scrolled(self._make_delays()), "Delay")
        self.tabs.addTab(_scrolled(self._make_tracker()), "Tracker")
        self.tabs.addTab(self._make_report(), "Report")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.head)
        layout.addWidget(self.camera)
        layout.addWidget(self.tabs, 1)
        bench.listen(Topic.SESSION, self._on_session)
        bench.listen(Topic.SETTINGS, self._on_settings)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.refresh)
        self._timer.start(POLL_MS)
        self.refresh()

    def _make_checks(self) -> QWidget:
        self.check_button = QPushButton("Check again")
        self.check_button.clicked.connect(lambda: self._bench.do("live.check_again"))
        self.checks_line = QLabel(NO_CHECKS)
        self.checks = ChecksTable()
        row = QHBoxLayout()
        row.addWidget(self.check_button)
        row.addWidget(self.checks_line, 1)
        page, layout = _page()
        layout.addLayout(row)
        layout.addWidget(self.checks, 1)
        return page

    def _make_delays(self) -> QWidget:
        self.latency = LatencyBar(NO_DELAYS)
        page, layout = _page()
        layout.addWidget(QLabel("From a picture's capture to its poses"))
        layout.addWidget(self.latency)
        layout.addStretch(1)
        return page

    def _make_tracker(self) -> QWidget:
        self.tracker = TrackerOptionsForm(self._bench)
        self.undo_button = QPushButton("Undo the last change")
        self.undo_button.setToolTip("both the change and its undoing are in the recording")
        self.undo_button.clicked.connect(lambda: self._bench.do("live.undo_tracker"))
        row = QHBoxLayout()
        row.addWidget(self.undo_button)
        row.addStretch(1)
        page, layout = _page()
        layout.addWidget(self.tracker)
        layout.addLayout(row)
        layout.addStretch(1)
        return page

    def _make_report(self) -> QWidget:
        self.report = QTextBrowser()
        self.report.setOpenLinks(False)
        self.report.setHtml(NO_REPORT)
        self.browser_button = QPushButton("Open in browser")
        self.browser_button.setEnabled(False)
        self.browser_button.clicked.connect(self._open_report)
        page, layout = _page()
        layout.addWidget(self.report, 1)
        layout.addWidget(self.browser_button)
        return page

    def show_tab(self, title: str) -> None:
        """Bring a tab to the front by its title."""
        titles = [self.tabs.tabText(place) for place in range(self.tabs.count())]
        self.tabs.setCurrentIndex(titles.index(title))

    # --- what goes on ----------------------------------------------------------------------------

    def refresh(self) -> None:
        """Show what the session has come to since."""
        job = self.live.job
        if job is not None and job is not self._job:
            self._job = job
            self.checks.clear()
            self.checks_line.setText("checking …")
            # Of a camera that pushes, the address to enter there is needed first.
            self.show_tab("Camera" if self.page.is_pushed else "Checks")
        if job is not None:
            self._take_checks(job)
        if not self.isVisible():
            return
        session = self.live.session
        status = None if session is None else session.status()
        self._refresh_buttons(job)
        self.quest.refresh()
        if session is None or status is None:
            self._take_report(job)
            self.head.show_idle(job)
            self.camera.show_idle()
            self.headset.refresh()
            return
        if status.state != self._state:
            self._state = status.state
            if status.state in TABS:
                self.show_tab(TABS[status.state])
        banner = banner_of(status, session.events(), now_ns=session.now_ns())
        drawing = job.drawing if job is not None else ""
        self.head.show_status(status, banner, drawing=drawing, is_locating=session.is_locating)
        is_simulated = job is not None and job.plan.is_simulated
        layout = self.live.shown_layout()
        self.camera.show_session(session, status, layout=layout, is_simulated=is_simulated)
        stages = {stage.name: stage for stage in status.stages}
        whole = stages.pop("whole", None)
        self.latency.show_stages(tuple(stages.values()), whole)
        self.page.refresh()
        self.headset.refresh()
        self.headset.show_session(session, status)

    def _take_checks(self, job: LiveJob) -> None:
        checks = job.found.take()
        if checks is not None:
            self.checks.show_checks(checks, THEMES[self._bench.settings.theme])
            verdict = worst(list(checks))
            self.checks_line.setText(f"{SHAPES[KINDS[verdict]]} {VERDICTS[verdict]}")

    def _refresh_buttons(self, job: LiveJob | None) -> None:
        is_running = self.live.is_running
        self.check_button.setEnabled(is_running and job is not None and not job.is_checking)
        self.undo_button.setEnabled(is_running)

    def _on_session(self) -> None:
        """A session began, went on or ended: only what changes by hand is shown at once."""
        self.head.refresh_button()
        session = self.live.session
        if session is None or session.state in (LiveState.CONFIRMING, LiveState.REFUSED):
            self.page.refresh()
        self._take_report(self.live.job)

    def _take_report(self, job: LiveJob | None) -> None:
        """Show the report of a session that ended, once; its head says so no earlier."""
        if job is None or job.running or job.report is None or job.report == self._shown_report:
            return
        self._shown_report = job.report
        self.report.setHtml(report_page(job.report.parent, self._bench.name_of))
        self.browser_button.setEnabled(True)
        self.show_tab("Report")

    def _on_settings(self) -> None:
        self.head.recolour()
        self.camera.recolour()
        self.headset.recolour()
        if self._job is not None and self._job.checks:
            self.checks.show_checks(self._job.checks, THEMES[self._bench.settings.theme])

    def _open_report(self) -> None:
        if self._shown_report is not None:
            page = browser_page(self._shown_report.parent)
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(page)))

    def closeEvent(self, event: QCloseEvent) -> None:
        """No longer follow the bench: the window closes."""
        self._timer.stop()
        self.tracker.close_form()
        for callback in (self._on_session, self._on_settings):
            self._bench.stop_listening(callback)
        event.accept()


def _scrolled(page: QWidget) -> QScrollArea:
    """A page that scrolls where the dock is low: state and button above it always stay."""
    area = QScrollArea()
    area.setWidgetResizable(True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setMinimumHeight(MIN_PAGE_PX)
    area.setWidget(page)
    return area


def _page() -> tuple[QWidget, QVBoxLayout]:
    page = QWidget()
    layout = QVBoxLayout(page)
    layout.setContentsMargins(8, 8, 8, 8)
    return page, layout
