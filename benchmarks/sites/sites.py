"""All sites of a simulated building in one process: `python -m benchmarks.sites.sites`."""

from __future__ import annotations

import sys
import time

from benchmarks.sites.orders import Counted, Orders, name_of, read_orders, say
from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.entry.pairing import MAX_CODES
from devices.hub.server import Hub
from devices.transport.keys import MemberRole
from devices.transport.zenoh_transport import ZenohTransport
from studio.live.sites.joined_site import JoinedSite


def run_sites(orders: Orders) -> None:
    """Run a hub for each room until standard input ends; a line asks for codes or counts."""
    clock = WallClock()
    ways: list[Counted] = []
    hubs: list[Hub] = []
    sites: list[JoinedSite] = []
    for number in range(orders.rooms):
        hub = Hub(HubSettings(max_people=orders.clients), {}, clock=clock)
        hub.start()
        way = Counted(ZenohTransport(orders.router, orders.pass_of(MemberRole.SITE, number)))
        site = JoinedSite(
            way,
            session=name_of(number),
            name=name_of(number),
            hub=hub,
            clock=clock,
            epoch=time.time_ns(),
            say=lambda _line: None,
        )
        site.start()
        ways.append(way)
        hubs.append(hub)
        sites.append(site)
    say(event="up", urls=[hub.url for hub in hubs])
    for line in sys.stdin:
        if line.startswith("code"):
            count = min(orders.clients, MAX_CODES)
            say(event="codes", codes=[[hub.invite().code for _ in range(count)] for hub in hubs])
            continue
        names = ("sent", "sent_bytes", "heard", "heard_bytes")
        totals = {name: sum(getattr(way, name) for way in ways) for name in names}
        to_clients = sum(hub.counts().sent_bytes for hub in hubs)
        reached = sum(site.status().is_reached for site in sites)
        say(event="counts", to_clients_bytes=to_clients, reached=reached, **totals)
    for site in sites:
        site.close()
    for hub in hubs:
        hub.close()
    for way in ways:
        way.close()


if __name__ == "__main__":
    run_sites(read_orders())
