"""People come, are away for a moment, and are forgotten."""

import pytest

from devices.hub import attendance as module
from devices.hub.attendance import ARRIVING_NS, AWAY_NS, Attendance, Limits
from devices.hub.entry.tokens import TOKEN_NS
from devices.hub.outbox import Outbox, Sent
from devices.hub.protocol.wire import Body, encode_body
from devices.hub.roles import Role
from devices.hub.session import Visit
from scenes.pose import Pose
from tests.devices.hub.protocol.test_messages import SAID


@pytest.fixture
def people():
    return Attendance()


def connect(guest):
    guest.outbox, guest.has_joined = Outbox(guest.person.index, Sent()), True


def test_everybody_gets_another_number(people):
    ids = [people.add("Anna", Role.REMOTE, now_ns=0).person.person_id for _ in range(3)]
    assert ids == ["p1", "p2", "p3"]
    people.remove("p3")
    people.remove("nobody")
    assert people.add("Ben", Role.REMOTE, now_ns=0).person.person_id == "p4"
    assert people.find("p3") is None


def test_numbers_end(people, monkeypatch):
    monkeypatch.setattr(module, "MAX_INDEX", 1)
    people.add("Anna", Role.REMOTE, now_ns=0)
    with pytest.raises(OverflowError, match="start a new session"):
        people.add("Ben", Role.REMOTE, now_ns=0)


def test_who_has_paired_is_not_listed_and_forgotten_after_two_minutes(people):
    guest = people.add("Anna", Role.REMOTE, now_ns=0)
    assert people.listed(0) == []
    assert people.arriving() == 1
    assert people.forget_old(ARRIVING_NS - 1) == []
    assert people.forget_old(ARRIVING_NS) == [guest]


def test_who_is_away_is_listed_for_30_s_and_remembered_while_the_token_is_good(people):
    guest = people.add("Anna", Role.REMOTE, now_ns=0)
    connect(guest)
    assert list(people.connected()) == [(guest, guest.outbox)]
    assert people.forget_old(10**15) == []
    guest.outbox, guest.away_since_ns = None, 0
    assert people.listed(AWAY_NS - 1) == [guest]
    assert people.listed(AWAY_NS) == []
    assert people.forget_old(TOKEN_NS - 1) == []
    assert people.forget_old(TOKEN_NS) == [guest]
    assert list(people.connected()) == []


def test_role_and_muting_change_on_their_own(people):
    guest = people.add("Anna", Role.REMOTE, now_ns=0)
    guest.change(is_muted=True)
    guest.change(role=Role.SPECTATOR)
    assert (guest.person.role, guest.person.is_muted) == (Role.SPECTATOR, True)
    assert guest.person.name == "Anna"


def test_a_headset_at_90_hz_is_within_the_limits():
    limits = Limits.new(0)
    assert all(limits.bodies.take(step * 10**9 // 90) for step in range(900))
    limits = Limits.new(0)
    taken = sum(limits.bodies.take(step * 10**9 // 1000) for step in range(10_000))
    assert 1090 <= taken <= 1101


def test_a_hub_knows_headsets_of_who_is_here_and_their_ages(room):
    anna, hers, _ = room.join("Anna")
    room.join("Ben")
    assert room.session.attendance.headsets(room.now_ns) == ()
    room.hear(anna, hers, **SAID)
    body = encode_body(Body(1, 1, Pose.identity()))
    room.now_ns += 2 * 10**9
    room.session.see_body(Visit(anna, hers), body, now_ns=room.now_ns)
    room.now_ns += 10**8
    (found,) = room.session.attendance.headsets(room.now_ns)
    assert (found.person.name, found.said.battery_percent) == ("Anna", 62.0)
    assert (found.said_age_s, found.body_age_s) == (2.1, 0.1)
    assert [it for it in room.drain(hers) if it.get("kind") == "refused"] == []
    room.hear(anna, hers, **{**SAID, "battery": 500})
    assert room.session.attendance.headsets(room.now_ns)[0].said.battery_percent == 62.0
    room.session.leave(Visit(anna, hers), room.now_ns)
    assert not room.session.attendance.headsets(room.now_ns)[0].person.is_connected
    room.now_ns += AWAY_NS
    assert room.session.attendance.headsets(room.now_ns) == ()
