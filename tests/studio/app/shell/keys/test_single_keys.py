"""Keys without Ctrl work in the view and the timeline, and nothing fires beside a field."""

import pytest

from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def type_there(text):
    """Types into what has the focus, as a keyboard does."""
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QApplication

    QTest.keyClicks(QApplication.focusWidget(), text)


def test_what_is_typed_beside_a_field_does_nothing(desk):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QApplication

    window, bench = desk.window, desk.window.bench
    view = window.view.active
    inspector = window.content("twin").inspector
    desk.edit()
    view.setFocus()
    bench.select(bench.scene.objects[0].object_id)
    viewer, done = view.viewer, len(bench.trace())
    desk.until(inspector.isVisible)
    QTest.mouseClick(inspector, Qt.MouseButton.LeftButton, pos=QPoint(3, 3))
    assert QApplication.focusWidget() is not view, "the click took the focus into the dock"
    type_there("v2f3 hp")
    assert (view.viewer, view.hand.tool, len(bench.trace())) == (viewer, "select", done)
    desk.press("Z", "Control")
    assert not bench.document.twin.primitives, "chords work anywhere"


def test_they_work_in_the_view_and_the_timeline(desk):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    window = desk.window
    view = window.view.active
    QTest.mouseClick(view, Qt.MouseButton.LeftButton)
    type_there("2")
    assert view.hand.tool == "move"
    window.content("timeline").setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    window.content("timeline").setFocus()
    type_there("1")
    assert view.hand.tool == "select"


def test_space_presses_the_button_that_has_the_focus(desk):
    bench = desk.window.bench
    bench.select(bench.scene.objects[0].object_id)
    button = desk.window.content("twin").inspector.frame
    desk.until(button.isVisible)
    button.setFocus()
    done = len(bench.trace())
    type_there(" ")
    assert [line.split()[0] for line in bench.trace()[done:]] == ["view.frame"]


def test_a_ring_shows_where_keys_go(desk):
    from PySide6.QtCore import Qt

    theme = desk.window.bench.settings.theme
    from studio.app.shell.theme import THEMES

    bench, view = desk.window.bench, desk.window.view.active
    bench.select(bench.scene.objects[0].object_id)
    button = desk.window.content("twin").inspector.frame
    desk.until(button.isVisible)
    button.setFocus(Qt.FocusReason.TabFocusReason)
    picture = button.grab().toImage()
    middle = picture.height() // 2
    assert [picture.pixelColor(x, middle).name() for x in (0, 1)] == [THEMES[theme].accent] * 2
    width = button.sizeHint().width()
    view.setFocus(Qt.FocusReason.TabFocusReason)
    assert button.sizeHint().width() == width, "nothing moves"
    desk.until(lambda: view.painted is not None)
    ringed = view.grab().toImage().pixelColor(1, view.height() // 2)
    view.setFocus(Qt.FocusReason.MouseFocusReason)
    view.clearFocus()
    view.setFocus(Qt.FocusReason.MouseFocusReason)
    assert view.grab().toImage().pixelColor(1, view.height() // 2) != ringed
