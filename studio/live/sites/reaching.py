"""The way to a router: its address, the pass for it, and which rooms are live there."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from devices.clock import WallClock
from devices.hub.site import is_loopback
from devices.sites.about import RoomAbout, read_about
from devices.transport.follower import Follower
from devices.transport.keys import ANY, Member, MemberRole, check_name
from devices.transport.passes import Pass, read_pass
from devices.transport.transport import Transport
from studio.console.extras import require_extra

DEFAULT_PORT = 7447
"""Port of a router where none is given: zenoh's own."""

LISTEN_S = 1.3
"""Time that beats are waited for, seconds: two of them, and the way."""

MAX_ROOMS = 4_096
"""Rooms that a list holds: four times a thousand."""


@dataclass(frozen=True, slots=True)
class RouterAddress:
    """A router, and maybe a room there.

    Attributes:
        host: name or address.
        port: where it listens.
        session: of a room; empty for none.
    """

    host: str
    port: int
    session: str = ""

    @property
    def words(self) -> str:
        """Host and port as they are written."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}"


def parse_router(text: str) -> RouterAddress:
    """Return the address in HOST[:PORT][/SESSION].

    Raises:
        ValueError: it is none.
    """
    place, _, session = text.partition("/")
    host, colon, port = place.rpartition(":")
    if not colon or place.endswith("]"):
        host, port = place, str(DEFAULT_PORT)
    host = host.strip("[]")
    if not host or not port.isdecimal() or not 0 < int(port) <= 65535:
        raise ValueError(f"router {text!r}: wanted HOST, HOST:PORT or HOST:PORT/SESSION")
    return RouterAddress(host, int(port), check_name(session) if session else "")


def read_given(address: RouterAddress, file: Path | None) -> Pass | None:
    """Return the pass in a file; None where the router is this computer's, and none is given.

    Raises:
        PassError: the file holds none.
        ValueError: the router is another computer's, and no pass is given.
    """
    if file is not None:
        return read_pass(file)
    if not is_loopback(address.host):
        raise ValueError(
            f"router {address.words} is not this computer: give --pass FILE, "
            "which `nexus sites admit` makes where the router is"
        )
    return None


def open_way(address: RouterAddress, given: Pass | None, *, what: str) -> Transport:
    """Connect to a router.

    Args:
        address: where it is.
        given: the pass for it.
        what: the command that needs it.

    Raises:
        MissingExtraError: zenoh is not installed.
        TransportError: it is not reached, or does not know the pass.
    """
    require_extra("sites", what=what)
    from devices.transport.zenoh_transport import ZenohTransport

    return ZenohTransport(address.words, given)


def live_rooms(transport: Transport, seconds: float = LISTEN_S) -> dict[str, RoomAbout]:
    """Return what the rooms say of themselves that are live, by session; takes some seconds."""
    follower = Follower(
        transport,
        Member(ANY, MemberRole.ROOM, ANY),
        limits={},
        logs=(),
        clock=WallClock(),
        max_members=MAX_ROOMS,
    )
    try:
        time.sleep(seconds)
        news = follower.take()
    finally:
        follower.close()
    return {
        each.member.session: read_about(each.about)
        for each in sorted(news, key=lambda one: one.member)
        if each.beat is not None
    }
