"""Layouts fit a window of any size, and a dock that floats comes back by its title bar."""

import pytest

from studio.app.shell.layouts import Layout
from studio.app.shell.theme import THEMES
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


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
    desk.until(lambda: desk.window._docks.width() == width)


def test_the_first_layout_has_the_same_shares_in_any_window(desk):
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


def test_a_saved_layout_fits_a_window_of_another_size(desk):
    window, bench = desk.window, desk.window.bench
    resize(desk, 1500, 900)
    window._docks.setSplitterSizes(window.docks["scenario"].dockAreaWidget(), [450, 450, 600])
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
