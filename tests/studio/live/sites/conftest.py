"""A room that is shared and a site of it in one process, without a router or a camera."""

import importlib.util
import time
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.server import Hub
from devices.sites.about import RoomAbout
from devices.transport.local import Exchange, LocalTransport
from scenes.state import SceneState, reduce_state
from studio.live.sites.joined_site import JoinedSite
from studio.live.sites.shared_room import SharedRoom
from tests.devices.transport.networks import ZenohNetwork

PATIENCE_S = 60.0


@dataclass
class Building:
    """Both sides, turned by hand, and a session that is no more than the reducer."""

    room: SharedRoom
    site: JoinedSite
    room_hub: Hub
    site_hub: Hub
    said: list
    state: SceneState = field(default_factory=SceneState)

    def change(self, *changes, t_ns=1):
        for change in changes:
            self.state = reduce_state(self.state, change, t_ns)

    def turn(self):
        """Do what a frame does: people's changes enter the session, its state goes out."""
        arrived = self.room.take()
        self.change(*arrived.avatars, *arrived.lines, *arrived.surfaces, *arrived.placed)
        self.room.publish(self.state)
        self.room.turn()
        self.site.turn()
        return arrived

    def until(self, happened):
        end = time.monotonic() + PATIENCE_S
        while not happened():
            assert time.monotonic() < end, "it did not happen in time"
            self.turn()
            time.sleep(0.01)


@contextmanager
def built(ways, *, session="lab"):
    """A building of a room and a site, with the transports of both."""
    clock, said = WallClock(), []
    hubs = [Hub(HubSettings(), {}, clock=clock) for _ in range(2)]
    for hub in hubs:
        hub.start()
    room = SharedRoom(
        ways[0],
        session,
        about=RoomAbout("lab", "abc"),
        inner=hubs[0],
        hub=lambda: hubs[0],
        clock=clock,
        epoch=1,
        say=said.append,
    )
    site = JoinedSite(
        ways[1],
        session=session,
        name="north",
        hub=hubs[1],
        clock=clock,
        epoch=1,
        say=said.append,
    )
    yield Building(room, site, hubs[0], hubs[1], said)
    for hub in hubs:
        hub.close()
    for each in (room, site):
        each._follower.close()
        each._source.close()


@pytest.fixture
def building():
    exchange = Exchange()
    with built([LocalTransport(exchange) for _ in range(2)]) as made:
        yield made


@pytest.fixture
def routed(tmp_path):
    """A building over a router with TLS and rules, and the network by which it is cut."""
    if importlib.util.find_spec("zenoh") is None:
        pytest.skip("eclipse-zenoh is not installed")
    network = ZenohNetwork(tmp_path / "building")
    try:
        ways = [network.open("room", "hall-3"), network.open("site", "north")]
        with built(ways, session="hall-3") as made:
            yield made, network
    finally:
        network.close()
