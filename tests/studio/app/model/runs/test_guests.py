"""Guests without a window: doors, codes, roles, undo."""

from types import SimpleNamespace

import pytest

from devices.hub.roles import Role
from studio.app.model.runs.guests import DoorState
from tests.studio.app.people.conftest import S, stage

__all__ = ["stage"]


def test_without_a_session_nobody_can_be_let_in(stage):
    assert stage.guests.state is DoorState.NO_SESSION
    assert stage.guests.people() == ()
    with pytest.raises(ValueError, match="check and connect first"):
        stage.guests.let_in()


def test_one_step_opens_the_doors_and_shows_a_code(stage):
    stage.play()
    assert stage.guests.state is DoorState.CLOSED
    stage.guests.let_in()
    stage.wait()
    assert stage.guests.state is DoorState.HERE
    assert stage.guests.invitation.code == "123456"
    assert stage.guests.seconds_left() == pytest.approx(120.0)
    stage.doors.t_ns = 119 * S
    assert stage.guests.seconds_left() == pytest.approx(1.0)
    stage.doors.t_ns = 121 * S
    assert stage.guests.seconds_left() == 0.0


def test_the_network_is_a_step_of_its_own(stage):
    hub = stage.open()
    stage.guests.ask_for_network()
    assert stage.guests.asks_for_network
    assert stage.guests.state is DoorState.HERE
    stage.guests.open_to_network()
    stage.wait()
    assert stage.guests.state is DoorState.NETWORK
    assert not stage.guests.asks_for_network
    assert stage.doors.hub is not hub
    assert stage.guests.invitation.url.startswith("https://192.168.1.20")


def test_what_cannot_be_opened_is_said(stage):
    stage.play().fails = OSError("port 8080 is taken")
    stage.guests.let_in()
    stage.wait()
    assert stage.guests.state is DoorState.CLOSED
    assert any("port 8080 is taken" in line for line in stage.lines())
    assert not stage.bench.busy


def test_a_new_code_makes_the_old_one_worthless(stage):
    hub = stage.open()
    stage.guests.invite("spectator")
    assert hub.revoked == ["123456"]
    assert stage.guests.invitation.role is Role.SPECTATOR
    stage.guests.let_in()
    assert stage.guests.invitation.role is Role.SPECTATOR, "the role that was chosen last"
    with pytest.raises(ValueError, match="wanted one of local, remote"):
        stage.guests.invite("king")


def test_a_code_goes_from_the_screen_when_somebody_has_come(stage):
    hub = stage.open()
    hub.come("Ana")
    stage.guests.poll()
    assert stage.guests.invitation is None
    assert any("Ana is here as remote" in line for line in stage.lines())
    assert not any("123456" in line for line in stage.lines()), "codes are never in the log"


def test_roles_and_muting_can_be_taken_back_one_by_one(stage):
    hub = stage.open()
    ana = hub.come("Ana")
    stage.guests.set_role("ana", "spectator")
    stage.guests.mute("p1")
    assert hub.here["p1"].is_muted
    assert stage.guests.undoes == "mute Ana"
    stage.guests.undo()
    assert not hub.here["p1"].is_muted
    assert hub.here["p1"].role is Role.SPECTATOR
    stage.guests.undo()
    assert hub.here["p1"] == ana
    with pytest.raises(ValueError, match="can be taken back"):
        stage.guests.undo()
    stage.guests.mute("Ana", is_muted=False)
    assert stage.guests.undoes == "", "nothing has changed"


def test_who_was_sent_away_is_gone_and_not_brought_back(stage):
    hub = stage.open()
    hub.come("Ana")
    stage.guests.mute("Ana")
    stage.guests.remove("Ana")
    assert stage.guests.people() == ()
    assert stage.guests.undoes == ""
    with pytest.raises(ValueError, match="here: nobody"):
        stage.guests.remove("Ana")


def test_two_of_one_name_are_told_apart_by_id(stage):
    hub = stage.open()
    hub.come("Ana")
    hub.come("ana")
    with pytest.raises(ValueError, match=r"Ana \(p1\), ana \(p2\)"):
        stage.guests.person("Ana")
    assert stage.guests.person("p2").name == "ana"


def test_closed_doors_and_an_ended_session_forget_code_and_people(stage):
    stage.open()
    stage.guests.close()
    assert stage.guests.state is DoorState.CLOSED
    assert stage.guests.invitation is None
    stage.guests.let_in()
    stage.wait()
    stage.doors = None
    stage.guests.poll()
    assert stage.guests.state is DoorState.NO_SESSION
    assert stage.guests.invitation is None


def test_doors_open_as_soon_as_a_session_begins_where_that_is_wanted(stage):
    stage.play()
    stage.wait()
    assert stage.guests.state is DoorState.CLOSED, "nobody wanted it"
    stage.guests.open_at_once()
    stage.wait()
    assert stage.guests.state is DoorState.CLOSED, "this session has begun already"
    stage.play()
    stage.wait()
    assert stage.guests.state is DoorState.HERE
    assert stage.guests.invitation.code == "123456"
    stage.guests.close()
    stage.wait()
    assert stage.guests.state is DoorState.CLOSED, "closed by hand they stay closed"
    # Doors that a command line has opened stay as they are.
    hub = stage.play().open(SimpleNamespace(is_open=True))
    stage.wait()
    assert stage.doors.hub is hub
    assert stage.guests.state is DoorState.NETWORK
    stage.guests.open_at_once(False)
    stage.play()
    stage.wait()
    assert stage.guests.state is DoorState.CLOSED
