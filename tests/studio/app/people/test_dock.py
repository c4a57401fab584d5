"""The panel, its rows and its actions, with doors that are made of nothing."""

from __future__ import annotations

import numpy as np
import pytest
import zxingcpp

from devices.hub.roles import Role
from scenes.frames import look_at
from scenes.state import Avatar, SceneState
from studio.app.model.actions import Action
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
HEAD = look_at(np.array([0.0, 0.0, 1.6]), np.array([1.0, 0.0, 1.5]))


@pytest.fixture
def panel(stage, qapp):
    from studio.app.people.dock import PeopleDock
    from studio.app.shell.actions.people import GuestActions

    GuestActions(stage.bench, stage.guests).add()
    stage.followed = []
    stage.bench.actions.add(
        Action("view.follow", "Look", "View", lambda person: stage.followed.append(person),
               arguments=("person",))
    )  # fmt: skip
    dock = PeopleDock(stage.bench)
    dock.resize(420, 640)
    dock.show()
    qapp.processEvents()
    yield dock
    dock.close()
    dock.deleteLater()


def opened(stage, panel):
    """Let people in by the button."""
    stage.play()
    panel.refresh()
    panel.let_in.click()
    stage.wait()
    panel.refresh()
    return stage.doors.hub


def test_one_click_from_a_running_session_to_a_code(stage, panel):
    assert not panel.let_in.isEnabled()
    assert "Check and connect" in panel.text.text()
    opened(stage, panel)
    assert panel.invitation.code.text() == "123 456"
    assert "2:00 left" in panel.invitation.left.text()
    assert "open on this computer" in panel.state.text()
    assert not panel.let_in.isVisible()


def test_people_are_let_in_with_the_next_session_by_a_tick(stage, panel):
    assert panel.at_once.isVisible()
    panel.at_once.click()
    panel.refresh()
    assert panel.at_once.isChecked()
    stage.play()
    stage.wait()
    panel.refresh()
    assert panel.invitation.code.text() == "123 456"
    assert not panel.at_once.isVisible()


def test_the_squares_on_the_screen_hold_the_link(stage, panel, qapp):
    opened(stage, panel)
    qapp.processEvents()
    image = panel.invitation.qr.grab().toImage().scaled(400, 400)
    grey = image.convertToFormat(image.Format.Format_Grayscale8)
    rows = np.frombuffer(grey.constBits(), np.uint8).reshape(grey.height(), grey.bytesPerLine())
    (found,) = zxingcpp.read_barcodes(rows[:, : grey.width()].copy())
    assert found.text == "http://127.0.0.1:8080/#code=123456"
    panel.invitation.copy.click()
    assert qapp.clipboard().text() == found.text
    assert not any("123456" in line for line in stage.lines())


def test_the_network_is_opened_after_a_warning(stage, panel):
    opened(stage, panel)
    panel.network.click()
    panel.refresh()
    assert panel.warning.isVisible()
    panel.refuse.click()
    assert not panel.warning.isVisible()
    panel.network.click()
    panel.confirm.click()
    stage.wait()
    panel.refresh()
    assert "open to this network" in panel.state.text()
    assert not panel.network.isVisible()
    assert panel.invitation.address.text() == "https://192.168.1.20:8443/"


def test_voices_are_recorded_by_a_button_that_shows_it(stage, panel):
    hub = opened(stage, panel)
    assert panel.record.text() == "Record voices"
    panel.record.click()
    panel.refresh()
    assert hub.is_voice_recorded
    assert "recorded" in panel.record.text()
    assert any("voices are recorded" in line for line in stage.lines())
    panel.record.click()
    assert not hub.is_voice_recorded


def test_everybody_has_a_row_that_says_how_they_are(stage, panel):
    hub = opened(stage, panel)
    hub.come("Ana <b>M</b>", latency_ms=31.0)
    hub.come("Ben", Role.SPECTATOR, is_connected=False)
    stage.guests.poll()
    panel.refresh()
    ana, ben = panel.rows["p1"], panel.rows["p2"]
    assert ana.name.text() == "Ana <b>M</b>"
    assert ana.latency.text() == "31 ms"
    assert "here" in ana.state.text()
    assert ben.role.currentData() == "spectator"
    assert "away" in ben.state.text()
    assert panel.here.text() == "2 people are here"
    assert "used" in panel.invitation.left.text()
    del hub.here["p2"]
    panel.refresh()
    assert list(panel.rows) == ["p1"]


def test_roles_muting_removing_and_undo(stage, panel):
    hub = opened(stage, panel)
    hub.come("Ana")
    panel.refresh()
    row = panel.rows["p1"]
    row.role.setCurrentIndex(row.role.findData("spectator"))
    row.role.activated.emit(row.role.currentIndex())
    assert hub.here["p1"].role is Role.SPECTATOR
    row.mute.click()
    panel.refresh()
    assert hub.here["p1"].is_muted
    assert row.mute.text() == "Unmute"
    assert panel.undo.isVisible()
    panel.undo.click()
    assert not hub.here["p1"].is_muted
    row.remove.click()
    panel.refresh()
    assert panel.rows == {}


def test_looking_from_their_eyes_waits_until_they_are_seen(stage, panel):
    hub = opened(stage, panel)
    hub.come("Ana")
    panel.refresh()
    row = panel.rows["p1"]
    assert not row.look.isEnabled()
    assert not stage.bench.do("people.follow", person="Ana")
    stage.bench.show_state(SceneState(avatars={"p1": Avatar("p1", "remote", HEAD)}))
    panel.refresh()
    row.look.click()
    assert stage.followed == ["p1"]


def test_scripts_do_all_of_it(stage, panel):
    stage.play()
    bench = stage.bench
    bench.perform("people.let_in")
    stage.wait()
    hub = stage.doors.hub
    hub.come("Ana")
    bench.perform("people.new_code", role="spectator")
    bench.perform("people.set_role", person="Ana", role="local")
    bench.perform("people.mute", person="Ana", muted=True)
    bench.perform("people.undo")
    assert hub.here["p1"].role is Role.LOCAL
    assert not hub.here["p1"].is_muted
    assert [choice.title for choice in bench.actions.check("people.mute", {}).choices()] == ["Ana"]
    bench.perform("people.remove", person="Ana")
    bench.perform("people.open_network")
    assert stage.guests.asks_for_network
    bench.perform("people.open_network", confirmed=True)
    stage.wait()
    bench.perform("people.close")
    assert stage.doors.hub is None


def test_the_pen_is_given_to_one_and_back_to_all(stage, panel):
    hub = opened(stage, panel)
    hub.come("Ann")
    hub.come("Ben")
    hub.come("Sam", Role.SPECTATOR)
    panel.refresh()
    assert not panel.rows["p3"].pen.isEnabled()
    panel.rows["p1"].pen.click()
    panel.refresh()
    assert [each.has_pen for each in hub.here.values()] == [True, False, False]
    assert "has the pen" in panel.rows["p1"].state.text()
    assert panel.rows["p1"].pen.text() == "Pen to all"
    panel.rows["p2"].pen.click()
    stage.bench.perform("people.undo")
    assert hub.here["p1"].has_pen, "as it was before Ben had it"
    panel.refresh()
    panel.rows["p1"].pen.click()
    assert not any(each.has_pen for each in hub.here.values())
    stage.bench.perform("people.undo")
    assert hub.here["p1"].has_pen
    stage.bench.perform("people.give_pen")
    assert not any(each.has_pen for each in hub.here.values())
    with pytest.raises(ValueError, match="draws nothing"):
        stage.guests.give_pen("Sam")
    assert stage.guests.undoes == "the pen for everybody"
