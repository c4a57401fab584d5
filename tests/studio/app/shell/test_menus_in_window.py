"""Menus say what is on, what can be done, and what would be undone."""

import pytest

from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def test_undo_and_redo_say_what_and_are_off_with_nothing_to_do(desk):
    menus, bench = desk.window.menus, desk.window.bench
    undo, redo = menus.qt_action("edit.undo"), menus.qt_action("edit.redo")

    def shown():
        return undo.isEnabled(), undo.text(), redo.isEnabled(), redo.text()

    assert shown() == (False, "Undo", False, "Redo")
    bench.perform("twin.add_primitive", shape="box")
    bench.perform("twin.rename", item="box-1", name="Crate")
    bench.perform("twin.move", item="box-1", place=[0.3, 0.0, 0.0])
    assert shown() == (True, "Undo: Move Crate", False, "Redo")
    desk.press("Z", "Control")
    assert shown() == (True, "Undo: Rename box-1", True, "Redo: Move Crate")
    desk.press("Z", "Control", "Shift")
    assert shown() == (True, "Undo: Move Crate", False, "Redo")
    for _ in range(3):
        undo.trigger()
    assert shown()[:2] == (False, "Undo")
    assert undo.iconText() == "Undo", "its button keeps its width"


def test_switches_have_check_marks_that_follow(desk):
    menus, bench = desk.window.menus, desk.window.bench
    labels, collision = (menus.qt_action(f"view.show_{name}") for name in ("labels", "collision"))
    assert (labels.isChecked(), collision.isChecked()) == (True, False)
    labels.trigger()
    assert not labels.isChecked()
    assert not bench.settings.layers["labels"]
    bench.perform("view.show_labels")
    assert labels.isChecked()
    turn, one, four = (menus.qt_action(f"view.{name}") for name in ("tool_turn", "one", "four"))
    turn.trigger()
    four.trigger()
    menus.menu("View").aboutToShow.emit()
    assert (turn.isChecked(), one.isChecked(), four.isChecked()) == (True, False, True)
    assert not menus.qt_action("view.home").isCheckable()


def test_what_there_is_nothing_of_cannot_be_cancelled_or_undone(desk):
    desk.window.content("preparation")
    menus = desk.window.menus
    menus.menu("Preparation").aboutToShow.emit()
    for name in ("preparation.cancel", "preparation.undo_cut"):
        assert not menus.qt_action(name).isEnabled()
    assert not desk.window.bench.do("preparation.cancel")


def test_a_session_and_its_recording_are_seen_from_where_one_was(desk):
    window, bench = desk.window, desk.window.bench
    bench.perform("view.orbit", yaw_deg=50.0, pitch_deg=5.0, steps=1.0)
    before = window.view.active.viewer
    desk.press("F5")
    desk.until(lambda: bench.standing.is_session)
    desk.until(lambda: window.view.active.painted is not None)
    assert window.view.active.viewer == before
    desk.until(lambda: bench.recording is not None)
    desk.until(lambda: not bench.busy and window.view.active.painted is not None)
    assert window.view.active.viewer == before
    assert window.line.startswith("recorded; the report is in") or "✗" in window.line
    assert window._status._count.text() == "", "one time is shown, the timeline's"
    bench.perform("view.home")
    assert window.view.active.viewer != before
