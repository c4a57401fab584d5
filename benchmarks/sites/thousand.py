"""A building of any size: which of its machines is full first, and how long messages wait there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.sites.load import Costs, load_of
from benchmarks.sites.queueing import Waiting, periodic_arrivals, wait_at

ROUTER_CORES = 16
"""Cores of a router, chosen: a usual server's."""

HUB_CORES = 1.0
"""Cores that a site's hub, or a room's sharing, can use: Python runs one thread at a time."""

NETWORK_BYTES = 10e9 / 8
"""Bytes a second of a router's network, 10 Gbit/s."""

SIMULATED_S = 0.4
"""Seconds of messages at the router that are simulated: 36 of each source at 90 Hz."""

FULL = 0.7
"""Utilisation from which a machine counts as full, chosen: beyond it, waiting grows steeply."""


@dataclass(frozen=True, slots=True)
class Reckoning:
    """A building of so many rooms.

    Attributes:
        rooms: how many.
        clients: people of each.
        utilisation: share of each machine's capacity that is taken, by its name, on one router.
        bottleneck: the machine that is full first.
        rooms_a_router: how many rooms one router takes before it counts as full.
        routers: how many it needs.
        at_router: waiting for the processor of a router that counts as full.
        site_people: most people at a site before its hub counts as full.
    """

    rooms: int
    clients: int
    utilisation: Mapping[str, float]
    bottleneck: str
    rooms_a_router: int
    routers: int
    at_router: Waiting
    site_people: int


def reckon(
    costs: Costs, *, rooms: int, clients: int, sites: int, hz: float, seed: int
) -> Reckoning:
    """Return how a building does.

    Args:
        costs: fitted to buildings that were measured.
        rooms: how many.
        clients: people of each room.
        sites: of each room, among which its people are divided.
        hz: bodies a second of each.
        seed: of arrivals and services.
    """
    load = load_of(costs, rooms=rooms, clients=clients, sites=sites, hz=hz)
    utilisation = {
        "router's network": load.bytes_out / NETWORK_BYTES,
        "router's processor": load.router_cpu / ROUTER_CORES,
        "site's hub": load.site_cpu / HUB_CORES,
        "room's sharing": load.room_cpu / HUB_CORES,
    }
    shared = max(utilisation["router's network"], utilisation["router's processor"])
    rooms_a_router = max(1, int(rooms * FULL / shared))
    return Reckoning(
        rooms,
        clients,
        utilisation,
        max(utilisation, key=lambda name: utilisation[name]),
        rooms_a_router,
        -(-rooms // rooms_a_router),
        _at_router(
            costs, min(rooms, rooms_a_router), clients=clients, sites=sites, hz=hz, seed=seed
        ),
        _site_people(costs, sites=sites, hz=hz),
    )


def _at_router(
    costs: Costs, rooms: int, *, clients: int, sites: int, hz: float, seed: int
) -> Waiting:
    """Return how messages wait for the router's processor."""
    generator = np.random.default_rng(seed)
    load = load_of(costs, rooms=rooms, clients=clients, sites=sites, hz=hz)
    sources = rooms * (1 + sites)
    arrivals = periodic_arrivals(
        sources, load.messages / sources, seconds=SIMULATED_S, generator=generator
    )
    service_s = load.router_cpu / load.messages / ROUTER_CORES
    return wait_at(arrivals, service_s, generator=generator)


def _site_people(costs: Costs, *, sites: int, hz: float) -> int:
    """Return the most people at each of so many sites of a room before their hubs are full."""
    people = 1
    while people < 256:
        load = load_of(costs, rooms=1, clients=(people + 1) * sites, sites=sites, hz=hz)
        if load.site_cpu > FULL * HUB_CORES:
            break
        people += 1
    return people
