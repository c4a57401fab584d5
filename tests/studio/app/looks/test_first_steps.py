"""A first user's way by mouse alone: change the scenario, scrub a recording, undo."""

import pytest

from studio.console.display import why_no_window
from tests.studio.app.looks.shots import open_stage, settle, until

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def window(qapp, tmp_path, looks_recording):
    stage = open_stage(tmp_path, theme="dark", size_px=(1280, 800), recording=looks_recording)
    yield stage.window
    stage.close()


def click(widget):
    """As a mouse does: only what is seen and can be pressed, in its middle."""
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    assert widget.isVisible()
    assert widget.isEnabled()
    assert widget.visibleRegion().contains(widget.rect().center()), "nobody can see it"
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton)


def drag(widget, start, end):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    QTest.mousePress(widget, Qt.MouseButton.LeftButton, pos=start)
    for k in range(1, 6):
        QTest.mouseMove(widget, start + (end - start) * k / 5)
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, pos=end)


def button(root, words):
    from PySide6.QtWidgets import QAbstractButton

    return next(b for b in root.findChildren(QAbstractButton) if words in b.text())


def test_every_way_of_the_first_page_is_inside_the_view(window):
    page = window.first_page
    assert window.view.rect().contains(page.geometry())
    for words in ("Rehearse this room", "Change what happens", "Bring your own", "All keys"):
        assert page.rect().contains(button(page, words).geometry())


def test_the_way_to_a_changed_scenario(window):
    from PySide6.QtCore import QPoint

    from studio.app.scenario.floor.view import to_scene

    click(button(window.first_page, "Change what happens"))
    assert not window.first_page.isVisible()
    dock = window.content("scenario")
    until(lambda: dock.floor._picture is not None)
    settle(0.1)
    before = dock.editing.scenario.people[0].start
    at = dock.floor.mapFromScene(to_scene(*before))
    drag(dock.floor.viewport(), at, at + QPoint(12, 16))
    assert dock.editing.scenario.people[0].start != before
    assert "•" in window.windowTitle()
    click(window.menus.toolbar.widgetForAction(window.menus.qt_action("edit.undo")))
    assert dock.editing.scenario.people[0].start == before


def test_a_recording_is_scrubbed_by_mouse_and_jumped_through_by_key(window, looks_recording, qapp):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    dock = window.content("timeline")
    window.bench.do("file.drop", paths=[str(looks_recording)])
    until(lambda: dock.is_open)
    settle(0.2)
    assert not window.first_page.isVisible()
    tracks = dock.tracks
    row = QPoint(round(tracks.x_of(200_000_000)), 60)
    drag(tracks, row, QPoint(round(tracks.x_of(100_000_000)), 60))
    assert dock.playback.t_ns == pytest.approx(100_000_000, abs=3_000_000)
    qapp.setActiveWindow(window)  # Xvfb has no window manager that would
    QTest.keyClick(window, Qt.Key.Key_Period, Qt.KeyboardModifier.ShiftModifier)
    assert dock.playback.t_ns == 300_000_000  # the push
    QTest.keyClick(window, Qt.Key.Key_Period)
    assert dock.playback.t_ns == 400_000_000


@pytest.mark.parametrize("text_scale", [pytest.param(1.0, marks=pytest.mark.slow), 1.5])
def test_nothing_scrolls_sideways_in_the_smallest_usual_window(window, text_scale):
    from PySide6.QtWidgets import QAbstractScrollArea, QPlainTextEdit, QTabWidget

    window.bench.set(text_scale=text_scale)
    settle(0.5)
    assert window.width() == 1280
    for dock_id in ("twin", "scenario", "session", "live", "preparation", "timeline", "keys"):
        window.bench.do(f"dock.{dock_id}")
        area = window.docks[dock_id]
        tabs = area.findChild(QTabWidget)
        for place in range(1 if tabs is None else tabs.count()):
            if tabs is not None:
                tabs.setCurrentIndex(place)
            settle(0.1)
            for each in area.findChildren(QAbstractScrollArea):
                if each.isVisible() and not isinstance(each, QPlainTextEdit):
                    wide = each.horizontalScrollBar().maximum()
                    what = f"{dock_id} {place}: {type(each).__name__}"
                    assert wide == 0, f"{what} is {wide} px too narrow"
