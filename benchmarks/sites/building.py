"""A router, rooms, sites and clients on this machine, each in a process of its own, measured."""

from __future__ import annotations

import json
import os
import queue
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.sites.clients import WARM_S
from benchmarks.sites.orders import STATE_HZ, Orders, name_of
from devices.transport.access import router_fields
from devices.transport.keys import MemberRole
from devices.transport.passes import Admitted, admit, keep_building, members
from scenes.workers.child_process import ChildProcess, module_command, module_environment

PATIENCE_S = 90.0
"""Longest wait for a process's next line, seconds: 16 rooms begin on a machine that is busy."""

ROUTER = """
import json, sys
from devices.transport.zenoh_transport import ZenohRouter
router = ZenohRouter(json.loads(sys.stdin.readline()))
print(json.dumps({"event": "up"}), flush=True)
sys.stdin.read()
"""
"""The router's process."""


@dataclass(frozen=True, slots=True)
class BuildingFigures:
    """Cost of a building, per second of its time.

    Attributes:
        rooms: how many rooms, each with a site.
        clients: people of each site.
        hz: bodies a second of each.
        router_cpu: cores that the router took.
        rooms_cpu: cores that all rooms' sharing took together.
        sites_cpu: cores that all sites took together, their hubs with them.
        room_messages: messages a second of one room.
        room_bytes: bytes a second of one room.
        site_messages: messages a second of one site to its room.
        site_bytes: bytes a second of one site to its room.
        client_bytes: bytes a second to one client.
        states_share: states that came to clients, of those that rooms made.
        age_ms: percentiles 50, 95, 99 of a state's age at a client.
    """

    rooms: int
    clients: int
    hz: float
    router_cpu: float
    rooms_cpu: float
    sites_cpu: float
    room_messages: float
    room_bytes: float
    site_messages: float
    site_bytes: float
    client_bytes: float
    states_share: float
    age_ms: tuple[float, float, float]


class _Part:
    """A process of the building: lines to it and from it."""

    def __init__(self, command: Sequence[str], first_line: str) -> None:
        self._lines: queue.Queue[str] = queue.Queue(1000)
        self.process = ChildProcess(
            command,
            stdin=subprocess.PIPE,
            on_line=self._lines.put,
            last_words=20,
            environment=module_environment(),
        )
        self.process.say(first_line)

    def hear(self, event: str) -> dict[str, Any]:
        """Return the next line of that kind.

        Raises:
            OSError: it has not come.
        """
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s and (self.process.is_running or not self._lines.empty()):
            try:
                fields: dict[str, Any] = json.loads(self._lines.get(timeout=0.2))
            except (queue.Empty, ValueError):
                continue
            if fields.get("event") == event:
                return fields
        words = " ".join(self.process.last_words()[-3:])
        raise OSError(f"a simulated building: no {event!r} from a process: {words}")

    def ask(self, question: str, event: str) -> dict[str, Any]:
        """Say a line, and return the answer."""
        self.process.say(question)
        return self.hear(event)

    def cpu_s(self) -> float:
        """Return the processor time that it has taken, seconds."""
        stat = Path(f"/proc/{self.process.process_id}/stat").read_text(encoding="ascii")
        user, system = stat.rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def run_building(rooms: int, clients: int, *, hz: float, seconds: float) -> BuildingFigures:
    """Return what a building on this machine took.

    Args:
        rooms: how many, each with one site.
        clients: people of each site.
        hz: bodies a second of each.
        seconds: how long it is measured.

    Raises:
        OSError: one of its processes has failed.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        address = _admit_all(folder, rooms)
        orders = Orders(address, str(folder), rooms, clients, hz, seconds + 1.0)
        fields = router_fields(folder, listen=address, members=members(folder))
        router = _begin(stack, [sys.executable, "-c", ROUTER], first_line=json.dumps(fields))
        router.hear("up")
        line = orders.to_line()
        shared = _begin(stack, module_command("benchmarks.sites.rooms"), first_line=line)
        shared.hear("up")
        sites = _begin(stack, module_command("benchmarks.sites.sites"), first_line=line)
        urls = sites.hear("up")["urls"]
        codes = sites.ask("code", "codes")["codes"]
        crowd = _begin(stack, module_command("benchmarks.sites.clients"), first_line=line)
        crowd.process.say(json.dumps({"urls": urls, "codes": codes}))
        crowd.hear("in")
        time.sleep(WARM_S)
        parts = (router, shared, sites)
        before = _look(parts)
        time.sleep(seconds)
        after = _look(parts)
        ended = crowd.hear("ended")
        return _figures(orders, before=before, after=after, ended=ended)


@dataclass(frozen=True, slots=True)
class _Look:
    time_s: float
    cpu_s: tuple[float, ...]
    rooms: dict[str, Any]
    sites: dict[str, Any]


def _look(parts: tuple[_Part, _Part, _Part]) -> _Look:
    router, shared, sites = parts
    cpu_s = tuple(part.cpu_s() for part in (router, shared, sites))
    return _Look(
        time.monotonic(), cpu_s, shared.ask("counts", "counts"), sites.ask("counts", "counts")
    )


def _figures(
    orders: Orders, *, before: _Look, after: _Look, ended: dict[str, Any]
) -> BuildingFigures:
    took_s = after.time_s - before.time_s
    cpu = [(b - a) / took_s for a, b in zip(before.cpu_s, after.cpu_s, strict=True)]

    def rate(name: str, *, of: str) -> float:
        return (getattr(after, of)[name] - getattr(before, of)[name]) / took_s

    due = orders.rooms * orders.clients * STATE_HZ * orders.seconds
    p50, p95, p99 = (float(age) for age in ended["age_ms"])
    return BuildingFigures(
        orders.rooms,
        orders.clients,
        orders.hz,
        cpu[0],
        cpu[1],
        cpu[2],
        rate("sent", of="rooms") / orders.rooms,
        rate("sent_bytes", of="rooms") / orders.rooms,
        rate("sent", of="sites") / orders.rooms,
        rate("sent_bytes", of="sites") / orders.rooms,
        rate("to_clients_bytes", of="sites") / (orders.rooms * orders.clients),
        ended["states"] / due,
        (p50, p95, p99),
    )


def _admit_all(folder: Path, rooms: int) -> str:
    """Make all passes; return an address for the router."""
    keep_building(folder, names=("127.0.0.1",))
    for number in range(rooms):
        for role in (MemberRole.ROOM, MemberRole.SITE):
            admit(folder, Admitted(role, name_of(number)))
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return f"127.0.0.1:{probe.getsockname()[1]}"


def _begin(stack: ExitStack, command: Sequence[str], *, first_line: str) -> _Part:
    part = _Part(command, first_line)
    stack.callback(part.process.end)
    return part
