"""Hostile peers on sockets: a server that misbehaves towards clients, a client towards servers.

Loopback only. For tests and measurements: what is attacked must live on, in bounded memory.
"""

from __future__ import annotations

import socket
from collections.abc import Sequence
from contextlib import suppress

from benchmarks.wire.hostile import hostile_stream
from sim.wire.accepting import AcceptingPort

PATIENCE_S = 1.0
"""How long the hostile side waits for the other one before it leaves."""

WAIT_S = 0.1
"""How often a thread looks whether it is to end."""


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
