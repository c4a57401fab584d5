"""Load of rooms and their people on each machine of a building, fitted to small ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from benchmarks.sites.building import BuildingFigures
from benchmarks.sites.orders import STATE_HZ
from studio.live.sites.turns import TICK_S

T = TypeVar("T")

TICK_HZ = 1.0 / TICK_S
"""Looks a second of a room and of a site at what is new."""

OTHER_HZ = STATE_HZ + 2.0
"""Messages a second of a room beside bodies: states and beats."""

BEAT_HZ = 2.0
"""Messages a second of a site beside bodies."""


@dataclass(frozen=True, slots=True)
class Costs:
    """Coefficients, none of them below zero.

    Attributes:
        router_cpu: (3,) cores of the router by itself; processor time for a message in or out, and
            for a byte of one.
        room_cpu: (3,) cores of a process with rooms by itself; for a room; for a body that it
            passes on.
        site_cpu: (4,) cores of a process with sites by itself; for a site and its hub; for a body
            of its people; for a body that goes to one of them.
        room_bytes: (2,) a second of one room: by itself, and for a body that it passes on.
        site_bytes: (2,) a second of one site: by itself, and for a body that it passes on.
    """

    router_cpu: NDArray[np.float64]
    room_cpu: NDArray[np.float64]
    site_cpu: NDArray[np.float64]
    room_bytes: NDArray[np.float64]
    site_bytes: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Load:
    """Load of a building, a second.

    Attributes:
        messages: into and out of the router.
        bytes_out: out of the router, the larger way.
        router_cpu: cores of the router.
        room_cpu: cores of one room's sharing, in a process of its own.
        site_cpu: cores of one site, its hub with it, in a process of its own.
        shared_cpu: cores of everything, with all rooms in one process and all sites in another.
    """

    messages: float
    bytes_out: float
    router_cpu: float
    room_cpu: float
    site_cpu: float
    shared_cpu: float


def bundles_hz(people: float, hz: float) -> float:
    """Return messages a second with bodies of so many people: one a look that finds a new one."""
    return TICK_HZ * (1.0 - float(np.exp(-people * hz / TICK_HZ)))


def fit_costs(measured: Sequence[BuildingFigures]) -> Costs:
    """Return costs of buildings that differ in rooms, each with one site, and in people."""
    traffic = [(1.0, *_traffic(each)) for each in measured]
    passed = [(1.0, _passed(each.clients, each.hz)) for each in measured]
    rooms = [
        (1.0, each.rooms, each.rooms * bodies) for each, (_, bodies) in _with(measured, passed)
    ]
    hubs = [_at_hub(each.clients, each.clients, hz=each.hz) for each in measured]
    sites = [
        (1.0, each.rooms, each.rooms * taken, each.rooms * given)
        for each, (taken, given) in _with(measured, hubs)
    ]

    def fitted(columns: Sequence[tuple[float, ...]], name: str) -> NDArray[np.float64]:
        values = np.array([float(getattr(each, name)) for each in measured])
        given = np.array(columns)
        scale = np.maximum(given.max(axis=0), 1e-12)  # messages and bytes differ by thousands
        return nnls(given / scale, values)[0] / scale

    return Costs(
        fitted(traffic, "router_cpu"),
        fitted(rooms, "rooms_cpu"),
        fitted(sites, "sites_cpu"),
        fitted(passed, "room_bytes"),
        fitted(passed, "site_bytes"),
    )


def load_of(costs: Costs, *, rooms: int, clients: int, sites: int, hz: float) -> Load:
    """Return the load of a building.

    Args:
        costs: as fitted.
        rooms: how many.
        clients: people of each room.
        sites: of each room, among which its people are divided.
        hz: bodies a second of each.
    """
    at_site = clients / sites
    room_hz = OTHER_HZ + bundles_hz(clients, hz)
    site_hz = BEAT_HZ + bundles_hz(at_site, hz)
    room_bytes = float(costs.room_bytes @ (1.0, _passed(clients, hz)))
    site_bytes = float(costs.site_bytes @ (1.0, _passed(at_site, hz)))
    messages = rooms * (room_hz * (1 + sites) + 2 * sites * site_hz)
    bytes_in = rooms * (room_bytes + sites * site_bytes)
    bytes_out = rooms * sites * (room_bytes + site_bytes)
    router_cpu = float(costs.router_cpu @ (1.0, messages, bytes_in + bytes_out))
    each_room = float(costs.room_cpu[1:] @ (1.0, _passed(clients, hz)))
    each_site = float(costs.site_cpu[1:] @ (1.0, *_at_hub(at_site, clients, hz=hz)))
    own_room, own_site = float(costs.room_cpu[0]), float(costs.site_cpu[0])
    shared_cpu = own_room + own_site + rooms * (each_room + sites * each_site)
    return Load(
        messages,
        bytes_out,
        router_cpu,
        own_room + each_room,
        own_site + each_site,
        router_cpu + shared_cpu,
    )


def error_percent(costs: Costs, measured: BuildingFigures) -> float:
    """Return how far off the cores of all machines together are, in percent."""
    true = measured.router_cpu + measured.rooms_cpu + measured.sites_cpu
    rooms, clients = measured.rooms, measured.clients
    load = load_of(costs, rooms=rooms, clients=clients, sites=1, hz=measured.hz)
    return 100.0 * (load.shared_cpu / true - 1.0)


def _passed(people: float, hz: float) -> float:
    """Return bodies a second that travel: with each new one, the newest of everybody."""
    return bundles_hz(people, hz) * people


def _at_hub(at_site: float, people: float, *, hz: float) -> tuple[float, float]:
    """Return bodies a second that a hub takes, and those that it gives to its people."""
    return at_site * hz, at_site * people * hz


def _traffic(figures: BuildingFigures) -> tuple[float, float]:
    """Return messages and bytes a second into and out of the router."""
    messages = figures.room_messages + figures.site_messages
    sent_bytes = figures.room_bytes + figures.site_bytes
    return 2.0 * figures.rooms * messages, 2.0 * figures.rooms * sent_bytes


def _with(
    measured: Sequence[BuildingFigures], rates: Sequence[T]
) -> list[tuple[BuildingFigures, T]]:
    return list(zip(measured, rates, strict=True))
