"""A building of any size: which of its machines is full first, and how long messages wait there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.sites.load import Costs, load_of

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

MAX_MESSAGES = 4_000_000
"""Messages that are simulated at a time, 32 MB of times."""


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


@dataclass(frozen=True, slots=True)
class Waiting:
    """Times at a machine.

    Attributes:
        utilisation: share of the time in which it works; 1 or more: it falls behind for ever.
        wait_ms: percentiles 50, 95, 99 of the time before a message is served.
    """

    utilisation: float
    wait_ms: tuple[float, float, float]


def periodic_arrivals(
    sources: int, hz: float, *, seconds: float, generator: np.random.Generator
) -> NDArray[np.float64]:
    """Return when messages come from sources that send at one rate, each at a phase of its own.

    Every message is late by up to a tenth of the period, as programs' timers are.

    Args:
        sources: how many.
        hz: messages a second of each.
        seconds: how long.
        generator: of phases and lateness.

    Raises:
        ValueError: that many are not simulated.
    """
    each = max(1, round(hz * seconds))
    if sources * each > MAX_MESSAGES:
        raise ValueError(f"{sources * each} messages, at most {MAX_MESSAGES}; simulate less time")
    phases = generator.uniform(0.0, 1.0, (sources, 1))
    late = generator.uniform(0.0, 0.1, (sources, each))
    times = (phases + late + np.arange(each)) / hz
    return np.sort(times, axis=None)


def waiting_times(
    arrivals_s: NDArray[np.float64], services_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how long each message waits until it is served, seconds (Lindley's recursion).

    Args:
        arrivals_s: (N,) times, in order.
        services_s: (N,) time that each takes.
    """
    gaps = np.diff(arrivals_s)
    steps = np.concatenate(([0.0], np.cumsum(services_s[:-1] - gaps)))
    return steps - np.minimum.accumulate(steps)


def wait_at(
    arrivals_s: NDArray[np.float64], service_s: float, *, generator: np.random.Generator
) -> Waiting:
    """Return how messages wait whose service takes an exponential time, as a program's does.

    Args:
        arrivals_s: (N,) times, in order.
        service_s: mean time of service: of a machine with n cores, an nth of one core's.
        generator: of the times of service.
    """
    services = generator.exponential(service_s, len(arrivals_s))
    waits = 1000.0 * waiting_times(arrivals_s, services)
    span_s = max(float(arrivals_s[-1] - arrivals_s[0]), 1e-9)
    p50, p95, p99 = np.percentile(waits, (50, 95, 99))
    return Waiting(len(arrivals_s) * service_s / span_s, (float(p50), float(p95), float(p99)))
