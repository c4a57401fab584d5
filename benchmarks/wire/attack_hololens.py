"""Hostile bytes at every port of a HoloLens: clients at a simulated one, and a hostile headset."""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from benchmarks.wire.attack_hub import HostilePeer, resident_bytes
from benchmarks.wire.fuzz_hololens import (
    body_packets,
    mapping_requests,
    meshes,
    openings,
    orders,
    settings,
    surface_lists,
    video_packets,
)
from devices.clock import WallClock
from devices.hololens.headset import Headset
from devices.hololens.plan import HeadsetPlan, Ports
from devices.hololens.wire.message_queue import encode_result
from devices.hololens.wire.remote_configuration import Request, Setting, encode_request
from scenes.samples import sample_room
from scenes.workers.task import Task
from sim.hololens.simulator import Simulator, SimulatorPlan
from sim.wire.hostile import hostile_stream
from studio.live.hololens.simulated.attacking import Defects

PATIENCE_S = 0.01
"""How long a hostile client reads before it leaves: the headset sends on by itself."""

WITNESS_S = 10.0
"""Longest wait until a friendly client is served after a hostile one."""

BATCH = 250
"""Hostile streams between two friendly clients."""

RETRY_S = 1e-3
"""Wait of a client between two hostile headsets."""

MAX_WAIT_S = 900.0
"""Longest time for all hostile headsets of a port."""


@dataclass(frozen=True, slots=True)
class HeadsetAttackCounts:
    """How both sides stood it.

    Attributes:
        streams: hostile connections, of all ports.
        crashes: errors that ended a thread, and times that somebody friendly was not served.
        growth_mb: memory that the process has more than after the first batch.
    """

    streams: int
    crashes: int
    growth_mb: float


def attack_simulator(streams: int, first_seed: int = 0) -> HeadsetAttackCounts:
    """Return how a simulated headset stands that many hostile streams a port, over loopback."""
    simulator = Simulator(SimulatorPlan(sample_room("desk")), WallClock())
    ports = simulator.ports
    clients = (
        (ports.configuration, settings()),
        # One in ten is a stream, which is drawn and coded for a client who leaves at once.
        (ports.video, (*openings()[:3] * 3, openings()[3])),
        (ports.body, (b"", b"a headset takes nothing here")),
        (ports.surfaces, mapping_requests()),
        (ports.display, orders()),
    )
    crashes, first = 0, 0
    with Defects() as defects:
        try:
            for at in range(0, streams, BATCH):
                count = min(BATCH, streams - at)
                for port, valid in clients:
                    for seed in range(first_seed + at, first_seed + at + count):
                        _misbehave(port, seed, valid=valid)
                crashes += not _is_served(ports.configuration)
                first = first or resident_bytes()
        finally:
            simulator.close()
    grown = (resident_bytes() - first) / 1e6
    return HeadsetAttackCounts(streams * len(clients), crashes + defects.count, grown)


def _misbehave(port: int, seed: int, *, valid: Sequence[bytes]) -> None:
    """Send one hostile stream, read a moment, hang up."""
    with (
        suppress(OSError),
        socket.create_connection(("127.0.0.1", port), WITNESS_S) as connection,
    ):
        connection.settimeout(WITNESS_S)
        for piece in hostile_stream(seed, valid):
            connection.sendall(piece)
        connection.shutdown(socket.SHUT_WR)
        connection.settimeout(PATIENCE_S)
        connection.recv(1 << 16)


def _is_served(port: int) -> bool:
    """Whether somebody friendly, who comes last, gets an answer."""
    asked = encode_request(Request(Setting.VERSION))
    with (
        suppress(OSError),
        socket.create_connection(("127.0.0.1", port), WITNESS_S) as connection,
    ):
        connection.settimeout(WITNESS_S)
        connection.sendall(asked)
        return len(connection.recv(8)) > 0
    return False


def attack_client(streams: int, first_seed: int = 0) -> HeadsetAttackCounts:
    """Return how a client stands that many hostile headsets at each of its ports."""
    peers = {
        "configuration": HostilePeer((bytes(8), bytes(range(8))), first_seed),
        "video": HostilePeer(video_packets(), first_seed),
        "body": HostilePeer(body_packets(), first_seed),
        "surfaces": HostilePeer((*surface_lists(), *meshes()), first_seed),
        "display": HostilePeer((encode_result(1), encode_result(101)), first_seed),
    }
    ports = Ports(**{name: peer.address[1] for name, peer in peers.items()})
    first = 0
    with Defects() as defects:
        headset = Headset(HeadsetPlan("127.0.0.1", ports, retry_s=RETRY_S), WallClock())
        stop_drawing = Task("draw", lambda task: _draw(headset, task)).start()
        until_s = time.monotonic() + MAX_WAIT_S
        crashes = 0
        try:
            while min(peer.served for peer in peers.values()) < streams:
                time.sleep(0.05)
                if not first and all(peer.served >= BATCH for peer in peers.values()):
                    first = resident_bytes()
                if time.monotonic() > until_s:
                    served = {name: peer.served for name, peer in peers.items()}
                    print(f"not connected again: {served}, wanted {streams}", file=sys.stderr)
                    crashes += 1
                    break
            # A decoder may die of a damaged picture in a process of its own; it is a defect still.
            crashes += sum("has died" in event.text for event in headset.take_events())
        finally:
            stop_drawing.cancel()
            stop_drawing.join(1.0)
            headset.close()
            for peer in peers.values():
                peer.close()
    grown = (resident_bytes() - (first or resident_bytes())) / 1e6
    return HeadsetAttackCounts(streams * len(peers), crashes + defects.count, grown)


def _draw(headset: Headset, task: Task[None]) -> None:
    """Have something else on the display all the time."""
    from devices.hololens.display_list import Label
    from scenes.pose import Pose

    number = 0
    while not task.pause(0.01):
        number += 1
        headset.draw({"label": Label(f"{number}", Pose.identity())})
