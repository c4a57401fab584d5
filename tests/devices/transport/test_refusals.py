"""A router with the documentation's rules: whoever is not who they say is not heard."""

import time
from dataclasses import replace

import pytest

from devices.transport.keys import Member, MemberRole
from devices.transport.passes import Admitted, admit, keep_building, members, read_pass
from devices.transport.source import Source
from devices.transport.transport import TransportError
from tests.devices.transport.conftest import PATIENCE_S

ROOM = Member("hall-3", MemberRole.ROOM, "hall-3")


class Ear:
    def __init__(self, transport, pattern):
        self.heard = []
        transport.subscribe(pattern, lambda key, data: self.heard.append((key, data)))

    def hears(self, within_s=0.5):
        end = time.monotonic() + within_s
        while time.monotonic() < end and not self.heard:
            time.sleep(0.01)
        return bool(self.heard)

    def until_heard(self, say):
        """Say something until it comes: who listens is known elsewhere a moment later."""
        end = time.monotonic() + PATIENCE_S
        while not self.heard:
            assert time.monotonic() < end, "nothing came"
            say()
            time.sleep(0.05)


def test_a_pass_speaks_for_its_own_name_alone(zenoh_network):
    room = zenoh_network.open("room", "hall-3")
    north = zenoh_network.open("site", "north")
    south = zenoh_network.open("site", "south")
    at_room, at_south = Ear(room, "gn/hall-3/site/**"), Ear(south, "gn/hall-3/room/hall-3/**")
    at_south.until_heard(lambda: room.put("gn/hall-3/room/hall-3/beat", b"its own"))
    at_room.until_heard(lambda: north.put("gn/hall-3/site/north/beat", b"its own"))
    for ear in (at_room, at_south):
        while ear.hears(0.5):  # what was said more than once
            ear.heard.clear()
    north.put("gn/hall-3/site/south/beat", b"another site's")
    north.put("gn/hall-3/room/hall-3/beat", b"the room's")
    room.put("gn/hall-4/room/hall-4/beat", b"another room's")
    assert not at_room.hears(0.4)
    assert not at_south.hears(0.1)


def test_a_site_does_not_hear_other_sites(zenoh_network):
    north, south = zenoh_network.open("site", "north"), zenoh_network.open("site", "south")
    everything = Ear(south, "gn/**")
    sites = Ear(south, "gn/hall-3/site/**")
    time.sleep(0.3)
    north.put("gn/hall-3/site/north/now/people", b"names")
    assert not everything.hears(0.4)
    assert not sites.hears(0.1)


def test_a_watcher_hears_beats_alone_and_says_nothing(zenoh_network):
    room, lobby = zenoh_network.open("room", "hall-3"), zenoh_network.open("watcher", "lobby")
    beats = Ear(lobby, "gn/*/room/*/beat")
    values = Ear(lobby, "gn/*/room/*/now/*")
    at_room = Ear(room, "gn/hall-3/site/**")
    answers = []
    Source(room, ROOM, logs=("drawn",), epoch=1).set("objects", b"secret")
    beats.until_heard(lambda: room.put("gn/hall-3/room/hall-3/beat", b"alive"))
    room.put("gn/hall-3/room/hall-3/now/objects", b"secret")
    lobby.put("gn/hall-3/site/lobby/beat", b"me")
    lobby.ask("gn/hall-3/room/hall-3/get/objects", b"?", answered=answers.append)
    assert not values.hears(0.4)
    assert not at_room.hears(0.1)
    assert answers == []


def test_nobody_answers_in_anothers_place(zenoh_network):
    room = zenoh_network.open("room", "hall-3")
    north, south = zenoh_network.open("site", "north"), zenoh_network.open("site", "south")
    north.serve("gn/hall-3/room/hall-3/get/*", lambda _key, _question: b"spoofed")
    time.sleep(0.3)
    answers = []
    south.ask("gn/hall-3/room/hall-3/get/objects", b"?", answered=answers.append)
    time.sleep(0.4)
    assert answers == []
    room.serve("gn/hall-3/room/hall-3/get/*", lambda _key, _question: b"true")
    end = time.monotonic() + PATIENCE_S
    while not answers:
        assert time.monotonic() < end, "no answer came"
        south.ask("gn/hall-3/room/hall-3/get/objects", b"?", answered=answers.append)
        time.sleep(0.4)
    assert set(answers) == {b"true"}


def test_without_a_pass_of_this_building_nobody_is_let_in(zenoh_network, tmp_path, monkeypatch):
    from devices.transport import zenoh_transport

    monkeypatch.setattr(zenoh_transport, "OPEN_S", 1.0)
    with pytest.raises(TransportError, match="does not know this pass"):
        zenoh_transport.ZenohTransport(zenoh_network.address, None)
    keep_building(tmp_path / "other", names=("127.0.0.1",))
    foreign = read_pass(admit(tmp_path / "other", Admitted(MemberRole.SITE, "north")))
    with pytest.raises(TransportError):
        zenoh_transport.ZenohTransport(zenoh_network.address, foreign)


def test_a_router_of_another_building_is_not_trusted(zenoh_network, tmp_path, monkeypatch):
    from devices.transport import zenoh_transport

    keep_building(tmp_path / "other", names=("127.0.0.1",))
    other = read_pass(admit(tmp_path / "other", Admitted(MemberRole.SITE, "north")))
    own = zenoh_network.pass_for("site", "north")
    with monkeypatch.context() as patch:
        patch.setattr(zenoh_transport, "OPEN_S", 1.0)
        with pytest.raises(TransportError):
            zenoh_transport.ZenohTransport(
                zenoh_network.address, replace(own, root_base64=other.root_base64)
            )
    zenoh_transport.ZenohTransport(zenoh_network.address, own).close()


def test_a_pass_whose_member_has_no_rule_is_worth_nothing(zenoh_network):
    room = zenoh_network.open("room", "hall-3")
    stranger = zenoh_network.open("site", "west")
    assert Admitted(MemberRole.SITE, "west") in members(zenoh_network.folder)
    heard, at_room = Ear(stranger, "gn/hall-3/room/hall-3/**"), Ear(room, "gn/hall-3/site/**")
    time.sleep(0.3)
    room.put("gn/hall-3/room/hall-3/beat", b"alive")
    stranger.put("gn/hall-3/site/west/beat", b"me")
    assert not heard.hears(0.4)
    assert not at_room.hears(0.1)


def test_a_message_that_is_too_long_is_not_sent(zenoh_network):
    north = zenoh_network.open("site", "north")
    with pytest.raises(ValueError, match="at most"):
        north.put("gn/hall-3/site/north/now/people", bytes(2_000_000))
