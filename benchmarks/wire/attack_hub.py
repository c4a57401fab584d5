"""Hostile peers on sockets: a server against clients, a client against servers and the hub's port.

Loopback only: what is attacked must live on, in bounded memory, the hub with somebody friendly in
the session.
"""

from __future__ import annotations

import http.client
import json
import resource
import socket
import struct
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.server import Hub
from sim.wire.accepting import AcceptingPort
from sim.wire.hostile import hostile_stream
from sim.wire.people_messages import frame, greeting_of, upgrade, valid_bodies, valid_texts

BATCH = 50
"""Hostile streams between two looks at the hub and its friendly client."""

WITNESS_S = 5.0
"""Longest time for an answer to the friendly client."""

REQUESTS = 3
"""Valid inputs that are HTTP; frames follow."""

PATIENCE_S = 1.0
"""How long the hostile side waits for the other one before it leaves."""

WAIT_S = 0.1
"""How often a thread looks whether it is to end."""


@dataclass(frozen=True, slots=True)
class AttackCounts:
    """How the hub stood it.

    Attributes:
        streams: hostile connections.
        crashes: defects that it said, and times that a friendly client was not served.
        refused: connections, messages and requests that it refused.
        growth_mb: memory that the process has more than after the first batch.
    """

    streams: int
    crashes: int
    refused: int
    growth_mb: float


def attack_hub(streams: int, first_seed: int = 0) -> AttackCounts:
    """Return how a hub stands that many hostile streams on loopback.

    Args:
        streams: how many; half of them come with a token that is good.
        first_seed: of the first; the others follow.
    """
    said: list[str] = []
    hub = Hub(HubSettings(), {"/": Asset(b"<p>", "text/html")}, clock=WallClock(), say=said.append)
    hub.start()
    try:
        address = _address(hub)
        valid, greeting = _valid(address), greeting_of(address, _pair(hub, address))
        witness = _Witness(address, greeting_of(address, _pair(hub, address)))
        crashes, first = 0, 0
        for at in range(0, streams, BATCH):
            count = min(BATCH, streams - at)
            is_let_in = at // BATCH % 2 == 1
            try:
                if is_let_in:
                    for seed in range(first_seed + at, first_seed + at + count):
                        _misbehave_inside(address, valid[REQUESTS:], greeting=greeting, seed=seed)
                else:
                    attack(address, valid, count, first_seed + at)
                _check_page(address)
                witness.check()
            except OSError as error:
                crashes += 1
                print(f"the hub after seed {first_seed + at}: {error}", file=sys.stderr)
            first = first or resident_bytes()
        defects = [line for line in said if "defect" in line]
        print("".join(f"{line}\n" for line in defects), end="", file=sys.stderr)
        grown = (resident_bytes() - first) / 1e6
        refused = sum(hub.counts().refused.values())
        return AttackCounts(streams, crashes + len(defects), refused, grown)
    finally:
        hub.close()


def _misbehave_inside(
    address: tuple[str, int], valid: Sequence[bytes], *, greeting: bytes, seed: int
) -> None:
    """Be let in, send one hostile stream, wait for the hub's end, hang up.

    Raises:
        OSError: the hub does not listen, or does not let somebody in whose token is good.
    """
    with socket.create_connection(address, WITNESS_S) as wire:
        wire.sendall(greeting)
        welcome = b""
        while b'"welcome"' not in welcome:
            came = wire.recv(1 << 16)
            if not came:
                raise OSError(f"seed {seed}: not let in")
            welcome += came
        with suppress(OSError):  # the hub has hung up: as it should
            for piece in hostile_stream(seed, valid):
                wire.sendall(piece)
            wire.shutdown(socket.SHUT_WR)
            while wire.recv(1 << 16):
                pass


def resident_bytes() -> int:
    """Return how much of the memory this process has."""
    statm = Path("/proc/self/statm").read_text(encoding="ascii")
    return int(statm.split()[1]) * resource.getpagesize()


class _Witness:
    """Somebody friendly in the session, who is answered whatever others do."""

    def __init__(self, address: tuple[str, int], greeting: bytes) -> None:
        self._wire = socket.create_connection(address, WITNESS_S)
        self._wire.sendall(greeting)
        self._asked = 1_000_000
        self.check()

    def check(self) -> None:
        """Ask for the time, and read all that came before the answer.

        Raises:
            OSError: no answer comes.
        """
        self._asked += 1
        self._wire.sendall(frame(b'{"kind":"ping","t_us":%d}' % self._asked, opcode=1))
        wanted, end = b'"t_us":%d' % self._asked, b""
        while wanted not in end:
            came = self._wire.recv(1 << 16)
            if not came:
                raise OSError("the friendly client was sent away")
            end = end[-100:] + came


def _valid(address: tuple[str, int]) -> tuple[bytes, ...]:
    """Return requests, then frames, of a friendly client."""
    host = f"{address[0]}:{address[1]}".encode()
    body = b'{"code":"000000","name":"Eve"}'
    return (
        b"GET / HTTP/1.1\r\nHost: " + host + b"\r\n\r\n",
        b"POST /pair HTTP/1.1\r\nHost: %b\r\nContent-Length: %d\r\n\r\n%b"
        % (host, len(body), body),
        upgrade(address),
        *(frame(text, opcode=1) for text in valid_texts()),
        *(frame(data, opcode=2) for data in valid_bodies()),
        frame(b"12345678", opcode=9),
        frame(b"12345678", opcode=10),
        frame(struct.pack(">H", 1000), opcode=8),
    )


def _address(hub: Hub) -> tuple[str, int]:
    host, port = hub.url.split("/")[2].split(":")
    return host, int(port)


def _pair(hub: Hub, address: tuple[str, int]) -> str:
    body = json.dumps({"code": hub.invite().code, "name": "Eve"})
    return str(json.loads(_ask(address, lambda it: it.request("POST", "/pair", body)))["token"])


def _check_page(address: tuple[str, int]) -> None:
    """Ask for the page, as anybody may at any time.

    Raises:
        OSError: it does not come.
    """
    _ask(address, lambda it: it.request("GET", "/"))


def _ask(address: tuple[str, int], request: Callable[[http.client.HTTPConnection], None]) -> bytes:
    connection = http.client.HTTPConnection(*address, timeout=5.0)
    try:
        request(connection)
        reply = connection.getresponse()
        if reply.status != 200:
            raise OSError(f"status {reply.status}, wanted 200")
        return reply.read()
    except http.client.HTTPException as error:
        raise OSError(f"no HTTP: {type(error).__name__}") from error
    finally:
        connection.close()


class HostilePeer:
    """A server on loopback; connection number n gets the hostile stream of seed `first_seed` + n.

    Args:
        valid: what a friendly device sends; most of what is sent are damaged copies.
        first_seed: of the first connection.
        greeting: what is sent first, so that clients go on.
    """

    def __init__(
        self, valid: Sequence[bytes], first_seed: int = 0, *, greeting: bytes = b""
    ) -> None:
        self._greeting = greeting
        self._valid, self._first_seed = tuple(valid), first_seed
        self.served = 0
        """Connections so far."""
        self._port = AcceptingPort("127.0.0.1", 0, name="hostile peer")
        self._port.start(self._serve)

    @property
    def address(self) -> tuple[str, int]:
        """Address at which it listens."""
        return self._port.address

    def close(self) -> None:
        """Stop; waits for the thread."""
        self._port.close()

    def _serve(self, connection: socket.socket) -> None:
        self.served += 1
        seed = self._first_seed + self.served - 1
        _misbehave(connection, seed, self._valid, self._greeting)


def attack(
    address: tuple[str, int], valid: Sequence[bytes], streams: int, first_seed: int = 0
) -> int:
    """Connect that many times to a server and send a hostile stream each time.

    Returns:
        Bytes that the server answered, all in all.

    Raises:
        OSError: the server does not listen any more.
    """
    answered = 0
    for seed in range(first_seed, first_seed + streams):
        connection = socket.create_connection(address, PATIENCE_S)
        answered += _misbehave(connection, seed, valid)
    return answered


def _misbehave(
    connection: socket.socket, seed: int, valid: Sequence[bytes], greeting: bytes = b""
) -> int:
    """Send one hostile stream, wait for the other side's end, hang up; bytes that came back."""
    came = 0
    with connection, suppress(OSError):
        connection.settimeout(PATIENCE_S)
        with suppress(OSError):  # the other side has hung up: as it should
            connection.sendall(greeting)
            for piece in hostile_stream(seed, valid):
                connection.sendall(piece)
        connection.shutdown(socket.SHUT_WR)
        while data := connection.recv(1 << 16):
            came += len(data)
    return came
