"""Layouts fit a window of any size, and a dock that floats comes back by its title bar."""

import pytest

from studio.app.shell.docking.layouts import FIRST_SHARES, Layout
from studio.app.shell.docking.window_docks import EMPTY_PX, RAISED_PX
from studio.app.shell.theme import THEMES
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def height(desk):
    """Of the timeline's area, in pixels, once layouts have settled."""
    from PySide6.QtWidgets import QApplication

    for _ in range(3):
        QApplication.processEvents()
    return desk.window.docks["timeline"].dockAreaWidget().height()


def drag_the_timeline(desk, by_px):
    """Drag the handle above the timeline, up by some pixels."""
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    area = desk.window.docks["timeline"].dockAreaWidget()
    splitter = area.parentWidget()
    handle = splitter.handle(1)
    start = handle.rect().center()
    QTest.mousePress(handle, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseMove(handle, start - QPoint(0, by_px))
    QTest.mouseRelease(handle, Qt.MouseButton.LeftButton, pos=start)


def shares(window):
    docks = window.docks
    width, height = window.width(), window.height()
    return (
        docks["twin"].width() / width,
        docks["scenario"].width() / width,
        docks["timeline"].height() / height,
    )


def resize(desk, width, height):
    desk.window.resize(width, height)
    desk.until(lambda: desk.window._docks.manager.width() == width)


def test_the_first_layout_has_the_same_shares_in_any_window(desk):
    desk.press("F5")
    desk.until(lambda: desk.window.bench.recording is not None and not desk.window.run.is_busy)
    desk.until(lambda: desk.window.content("timeline").is_open)
    resize(desk, 1000, 660)
    desk.window.bench.perform("layout.reset")
    left, right, bottom = shares(desk.window)
    resize(desk, 1560, 960)
    desk.window.bench.perform("layout.reset")
    large = shares(desk.window)
    assert large == pytest.approx((left, right, bottom), abs=0.04)
    assert large[:2] == pytest.approx((0.18, 0.35), abs=0.02)
    texts = [desk.window.docks[name].tabWidget().isTitleElided() for name in ("scenario", "live")]
    assert not any(texts), "names of tabs are whole"


@pytest.mark.parametrize("size", [(1000, 660), pytest.param((1560, 960), marks=pytest.mark.slow)])
def test_an_empty_timeline_is_low_in_a_window_of_any_size_and_shows_all_it_says(desk, size):
    resize(desk, *size)
    assert height(desk) == EMPTY_PX
    desk.window.bench.perform("layout.reset")
    assert height(desk) == EMPTY_PX
    area, dock = desk.window.docks["timeline"].dockAreaWidget(), desk.window.content("timeline")
    for part in (dock.empty.words, dock.empty.buttons["session.rehearse"]):
        assert part.visibleRegion().boundingRect() == part.rect()
        assert area.rect().contains(part.mapTo(area, part.rect().bottomRight()))


def test_a_low_timeline_takes_its_share_when_a_session_plays_and_keeps_it(desk):
    bench = desk.window.bench
    bench.perform("session.rehearse")
    desk.until(lambda: bench.standing.is_session)
    share_px = FIRST_SHARES[0][1] * desk.window._docks.manager.height()
    assert height(desk) == pytest.approx(max(RAISED_PX, share_px), abs=9)
    desk.until(lambda: bench.recording is not None and not desk.window.run.is_busy)
    desk.until(lambda: desk.window.content("timeline").is_open)
    raised = height(desk)
    bench.perform("timeline.close")
    assert height(desk) == raised


def test_a_low_timeline_takes_its_share_when_a_recording_is_opened_also_in_the_next_window(
    desk, tmp_path
):
    desk.press("F5")
    desk.until(lambda: desk.window.bench.recording is not None and not desk.window.run.is_busy)
    recording = desk.window.bench.recording
    desk.window.bench.perform("timeline.close")
    desk.window.bench.perform("layout.reset")
    assert height(desk) == EMPTY_PX
    desk.window.close()
    desk.window = desk.window_on(desk.window.bench.document)
    assert desk.window.bench.settings.layout
    assert height(desk) == EMPTY_PX
    desk.window.bench.perform("timeline.open", path=str(recording))
    desk.until(lambda: desk.window.content("timeline").is_open)
    assert height(desk) > 2 * EMPTY_PX


def test_a_height_that_a_hand_has_chosen_stays(desk):
    drag_the_timeline(desk, 60)
    chosen = height(desk)
    assert chosen == pytest.approx(EMPTY_PX + 60, abs=8)
    desk.press("F5")
    desk.until(lambda: desk.window.bench.recording is not None and not desk.window.run.is_busy)
    desk.until(lambda: desk.window.content("timeline").is_open)
    assert height(desk) == chosen
    desk.window.bench.perform("timeline.close")
    desk.window.close()
    desk.window = desk.window_on(desk.window.bench.document)
    assert height(desk) == chosen


def test_a_low_timeline_is_higher_for_bigger_text(desk):
    desk.window.bench.perform("view.text", scale=1.5)
    assert height(desk) == round(1.5 * EMPTY_PX)
    desk.window.bench.perform("view.text", scale=1.0)
    assert height(desk) == EMPTY_PX


def test_a_saved_layout_fits_a_window_of_another_size(desk):
    window, bench = desk.window, desk.window.bench
    resize(desk, 1500, 900)
    window._docks.manager.setSplitterSizes(
        window.docks["scenario"].dockAreaWidget(), [450, 450, 600]
    )
    bench.perform("layout.save", name="wide")
    resize(desk, 1200, 700)
    bench.perform("layout.reset")
    bench.perform("layout.load", name="wide")
    assert shares(window)[:2] == pytest.approx((0.3, 0.4), abs=0.03)


def test_a_layout_of_before_shares_were_kept_can_be_read():
    kept = Layout(b"abc", ((0.5, 0.5),))
    assert Layout.from_text(kept.text()) == Layout(b"abc", [[0.5, 0.5]])
    assert Layout.from_text("YWJj") == Layout(b"abc")
    with pytest.raises(ValueError, match="damaged"):
        Layout.from_text("{}")


def test_a_floating_dock_comes_back_by_its_button(desk):
    from PySide6.QtWidgets import QToolButton

    docks = desk.window.docks
    for name, neighbour in (("sessions", "twin"), ("timeline", None)):
        before = docks[name].dockAreaWidget().geometry()
        docks[name].setAsCurrentTab()
        docks[name].setFloating()
        assert docks[name].isInFloatingContainer()
        floating = docks[name].floatingDockContainer()
        button = floating.findChild(QToolButton, "floatingTitleDockButton")
        desk.until(lambda button=button: button.isVisible() and button.height() > 9)
        desk.click(button)
        assert not docks[name].isInFloatingContainer()
        desk.until(docks[name].isVisible, 5)
        if neighbour is not None:
            assert docks[name].dockAreaWidget() is docks[neighbour].dockAreaWidget()
        else:
            assert docks[name].dockAreaWidget().geometry().width() == before.width()


def test_a_floating_dock_is_dragged_back_by_its_title_bar(desk):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtGui import QCursor
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QWidget

    docks = desk.window.docks
    docks["sessions"].setAsCurrentTab()
    docks["sessions"].setFloating()
    floating = docks["sessions"].floatingDockContainer()
    title = floating.findChild(QWidget, "floatingTitleLabel")
    desk.until(lambda: title.isVisible() and title.height() > 9)
    area = docks["twin"].dockAreaWidget()
    target = area.mapToGlobal(area.rect().center())
    left = Qt.MouseButton.LeftButton

    def move(to):
        QCursor.setPos(to)
        QTest.mouseMove(title, title.mapFromGlobal(to))

    QTest.mousePress(title, left, pos=QPoint(20, 8))
    start = title.mapToGlobal(QPoint(20, 8))
    for share in (0.2, 0.5, 0.8, 1.0, 1.0):
        move(start + (target - start) * share)
    QTest.mouseRelease(title, left, pos=title.mapFromGlobal(target))
    desk.until(lambda: not docks["sessions"].isInFloatingContainer(), 5)


def test_the_active_tab_keeps_its_accent_after_a_change_of_theme(desk):
    tab = desk.window.docks["twin"].tabWidget()
    for name in ("light", "dark", "light"):
        desk.window.bench.perform("view.theme", name=name)
        desk.until(lambda: tab.isVisible())
        top = tab.grab().toImage().pixelColor(tab.width() // 2, 0).name()
        assert top == THEMES[name].accent
