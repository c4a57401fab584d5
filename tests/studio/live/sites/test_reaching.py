"""Addresses and passes: read, or refused with what to do."""

import pytest

from devices.transport.keys import KeyNameError, MemberRole, room
from devices.transport.local import Exchange, LocalTransport
from devices.transport.passes import Admitted, admit, keep_building
from devices.transport.source import Source
from studio.live.sites.building import router_configuration
from studio.live.sites.reaching import RouterAddress, live_rooms, parse_router, read_given
from studio.live.sites.sharing import name_for


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("10.0.0.5", ("10.0.0.5", 7447, "")),
        ("10.0.0.5:80/hall-3", ("10.0.0.5", 80, "hall-3")),
        ("host/lab", ("host", 7447, "lab")),
        ("[::1]:80/lab", ("::1", 80, "lab")),
        ("[::1]", ("::1", 7447, "")),
    ],
)
def test_addresses(text, address):
    assert parse_router(text) == RouterAddress(*address)


@pytest.mark.parametrize("text", ["", ":80", "host:0", "host:99999", "host:x", "/lab"])
def test_what_is_no_address(text):
    with pytest.raises(ValueError, match="HOST"):
        parse_router(text)


def test_a_room_s_name_is_checked():
    with pytest.raises(KeyNameError):
        parse_router("host/Hall 3")


def test_another_computer_needs_a_pass(tmp_path):
    assert read_given(parse_router("127.0.0.1"), None) is None
    with pytest.raises(ValueError, match="nexus sites admit"):
        read_given(parse_router("10.0.0.5"), None)
    keep_building(tmp_path, names=("127.0.0.1",))
    file = admit(tmp_path, Admitted(MemberRole.SITE, "north"))
    assert read_given(parse_router("10.0.0.5"), file).admitted.name == "north"


def test_a_pass_is_for_one_role_and_name():
    of_pass = (MemberRole.SITE, "north")
    assert name_for(MemberRole.SITE, "", of_pass=of_pass) == "north"
    assert name_for(MemberRole.ROOM, "lab", of_pass=None) == "lab"
    with pytest.raises(ValueError, match="the pass is site north's"):
        name_for(MemberRole.ROOM, "", of_pass=of_pass)
    with pytest.raises(ValueError, match="not site south's"):
        name_for(MemberRole.SITE, "south", of_pass=of_pass)


class Beating(LocalTransport):
    """A transport on which everybody beats as soon as somebody listens."""

    def __init__(self, exchange, sources):
        super().__init__(exchange)
        self._sources = sources

    def subscribe(self, pattern, handler):
        end = super().subscribe(pattern, handler)
        for source in self._sources:
            source.beat(1, {"scene": f"{source.member.name} scene", "people": 2})
        return end


def test_rooms_that_are_live_are_listed():
    exchange = Exchange()
    names = ("lab", "hall-3")
    sources = [Source(LocalTransport(exchange), room(name), logs=(), epoch=1) for name in names]
    rooms = live_rooms(Beating(exchange, sources), 0.0)
    assert {name: (about.scene, about.people) for name, about in rooms.items()} == {
        "hall-3": ("hall-3 scene", 2),
        "lab": ("lab scene", 2),
    }
    assert live_rooms(LocalTransport(exchange), 0.0) == {}


def test_a_router_without_tls_is_for_this_computer_alone(tmp_path):
    fields = router_configuration(tmp_path, parse_router("127.0.0.1"), is_plain=True)
    assert "access_control" not in fields
    with pytest.raises(ValueError, match="this computer alone"):
        router_configuration(tmp_path, parse_router("0.0.0.0"), is_plain=True)
