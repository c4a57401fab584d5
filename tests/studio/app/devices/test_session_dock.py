"""The session panel in a real window: checks, log, report."""

import json
import time
from types import SimpleNamespace

import pytest

from studio.app.devices.report_html import report_page
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
needs_window = pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")


@pytest.fixture
def bench(tmp_path, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path / "home"))
    return Workbench(Document("lab"), Settings(), SimpleNamespace(push=print, clear=print))


@pytest.fixture
def rehearsal(tmp_path):
    folder = tmp_path / "walk"
    folder.mkdir()
    rows = [
        {"name": "error.cm", "value": 2.25, "unit": "cm", "bar": 2.0, "passed": False},
        {"name": "frames", "value": 120, "unit": "", "bar": None, "passed": None},
    ]
    (folder / "report.json").write_text(json.dumps({"rows": rows}))
    return folder


def test_a_report_is_a_page_with_its_limits_and_a_damaged_one_says_so(rehearsal):
    page = report_page(rehearsal)
    assert "✖ 1 of 1 limits missed" in page
    assert "2.25" in page
    (rehearsal / "report.json").write_text("[1")
    assert "cannot be read" in report_page(rehearsal)


@needs_window
@pytest.mark.gui
def test_checks_run_beside_the_window_and_are_listed_and_saved(bench, qtbot, tmp_path):
    from studio.app.devices.dock import SessionDock

    dock = SessionDock(bench)
    qtbot.addWidget(dock)
    started = time.process_time()  # what else the machine does is not counted
    assert bench.do("session.check")
    assert not dock.check_button.isEnabled()
    qtbot.waitUntil(lambda: dock.checks.topLevelItemCount() == 9, timeout=240_000)
    assert time.process_time() - started < 30
    assert (tmp_path / "home" / "preflight.json").is_file()
    assert "ready" in dock.checks_line.text()


@needs_window
@pytest.mark.gui
def test_the_log_is_filtered_searched_and_copied_and_the_report_opens_inside(
    bench, qtbot, rehearsal
):
    from PySide6.QtGui import QGuiApplication

    from studio.app.devices.dock import SessionDock

    dock = SessionDock(bench)
    qtbot.addWidget(dock)
    bench.say("info", "hello")
    bench.say("error", "lens lost")
    bench.say("error", "disk full")
    dock.level.setCurrentText("error")
    assert dock.log.count() == 2
    dock.search.setText("LENS")
    assert dock.log.count() == 1
    dock.copy_log()
    assert QGuiApplication.clipboard().text().endswith("✖ lens lost")
    bench.open_recording(rehearsal / "recording.mcap")
    assert "error, cm" in dock.report.toPlainText()
    assert not dock.browser_button.isEnabled()
