"""People of other hubs: listed, shown, and gone."""

import json

from devices.hub import elsewhere as module
from devices.hub.channels import BodyChannel
from devices.hub.elsewhere import FIRST_INDEX, LAST_INDEX, Elsewhere, Others
from devices.hub.roles import Person, Role


def far(name, body=b"", **fields):
    return Elsewhere(Person(name, 1, name, Role.REMOTE, **fields), body)


def test_they_get_numbers_of_their_own_and_bodies_that_are_new():
    others, bodies = Others(), BodyChannel()
    assert others.take([far("north.p1", b"1"), far("south.p1")], bodies)
    indices = [person.index for person in others.people()]
    assert indices == [FIRST_INDEX, FIRST_INDEX + 1]
    assert bodies.counter == 1
    assert not others.take([far("north.p1", b"1"), far("south.p1")], bodies)
    assert bodies.counter == 1, "the same body is not sent again"
    assert not others.take([far("north.p1", b"2"), far("south.p1")], bodies)
    assert [index for index, _, _ in bodies.since(1, but=0)] == [FIRST_INDEX]
    assert others.take([far("south.p1")], bodies)
    assert bodies.since(0, but=0) == []
    assert others.take([far("south.p1"), far("north.p1")], bodies)
    assert others.people()[1].index == FIRST_INDEX + 2, "a number is not given again at once"


def test_a_change_of_name_or_muting_is_told():
    others, bodies = Others(), BodyChannel()
    others.take([far("north.p1", b"1")], bodies)
    assert others.take([far("north.p1", is_muted=True)], bodies)
    assert bodies.since(0, but=0) == []


def test_numbers_begin_again_and_there_is_a_limit(monkeypatch):
    others, bodies = Others(_next=LAST_INDEX), BodyChannel()
    others.take([far("a"), far("b")], bodies)
    assert [person.index for person in others.people()] == [LAST_INDEX, FIRST_INDEX]
    monkeypatch.setattr(module, "MAX_ELSEWHERE", 2)
    others.take([far("a"), far("c"), far("d")], bodies)
    assert len(others.people()) == 2


def test_people_of_the_session_see_them(room):
    _guest, outbox, welcome = room.join()
    assert len(welcome["people"]) == 1
    room.session.meet([far("north.p1", b"\x01\x01body")], room.now_ns)
    found = room.drain(outbox)
    people = [m for m in found if isinstance(m, dict) and m["kind"] == "people"]
    assert [each["id"] for each in people[-1]["people"]] == ["p1", "north.p1"]
    assert any(isinstance(m, bytes) for m in found)
    assert len(room.session.people(room.now_ns)) == 1, "the operator's list has one's own"
    late = room.join("Ben")[2]
    assert "north.p1" in json.dumps(late["people"])
    room.session.meet([], room.now_ns)
    assert "north.p1" not in json.dumps(room.drain(outbox)[-1])
