"""The hub's port: so many connections at the same time, so many from one address."""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from aiohttp import web

from devices.hub.contract import HubSettings
from devices.hub.entry.certificates import Certificates, host_names, lan_addresses

MAX_CONNECTIONS = 256
"""Connections of all kinds; chosen: 32 people, six files at a time each, and room above."""

MAX_FROM_ONE = 64
"""Connections from one address of the network; chosen: eight people behind one router."""

HANDSHAKE_S = 10.0
"""Time for the handshake of TLS; chosen: a phone on a bad network."""

RETRY_S = 0.1
"""Pause where the system has no descriptor left for another connection."""

EVERYWHERE = ("0.0.0.0", "::", "")
"""Hosts that stand for all of this machine's addresses."""


def own_names(settings: HubSettings, addresses: Iterable[str]) -> frozenset[str]:
    """Return the names by which a hub is reached: addresses, this machine's, those it is given."""
    names = (*addresses, *host_names(), *settings.names, settings.host)
    return frozenset(name.lower() for name in names if name not in EVERYWHERE)


def address_of(settings: HubSettings, port: int) -> str:
    """Return the page's address, with the machine's own where it is open to the network."""
    scheme = "http" if settings.certificate_folder is None else "https"
    host = lan_addresses()[0] if settings.host in EVERYWHERE else settings.host
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}/"


class Port:
    """Accepts connections for a server of HTTP, and closes those that are too many at once.

    Args:
        server: makes the protocol of each.
        tls: certificates; None for plain TCP.
    """

    def __init__(self, server: web.Server, tls: ssl.SSLContext | None) -> None:
        self._server, self._tls = server, tls
        self._socket: socket.socket | None = None
        self._accepting: asyncio.Task[None] | None = None
        self._shaking: dict[asyncio.Task[None], tuple[str, ...]] = {}

    def open(self, host: str, port: int) -> int:
        """Listen; return the port. On the loop's thread.

        Raises:
            OSError: the port is taken, or the host is not of this machine.
        """
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._socket = socket.create_server((host, port), family=family, backlog=64)
        self._socket.setblocking(False)
        self._accepting = asyncio.ensure_future(self._accept(self._socket))
        return int(self._socket.getsockname()[1])

    async def close(self) -> None:
        """Accept no more; what is open stays."""
        tasks = [*self._shaking, *([] if self._accepting is None else [self._accepting])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._socket is not None:
            self._socket.close()

    async def _accept(self, listening: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                wire, peer = await loop.sock_accept(listening)
            except OSError:
                await asyncio.sleep(RETRY_S)
                continue
            address = str(peer[0])
            if self._has_room(address):
                task = asyncio.ensure_future(self._shake_hands(wire))
                self._shaking[task] = peer
                task.add_done_callback(self._shaking.pop)
            else:
                wire.close()

    async def _shake_hands(self, wire: socket.socket) -> None:
        try:
            await asyncio.get_running_loop().connect_accepted_socket(
                self._server,
                wire,
                ssl=self._tls,
                ssl_handshake_timeout=None if self._tls is None else HANDSHAKE_S,
            )
        except (OSError, asyncio.CancelledError):  # no TLS, or not in time
            with suppress(OSError):
                wire.close()

    def _has_room(self, address: str) -> bool:
        peers: list[Any] = [connection.peername for connection in self._server.connections]
        # Who has just shaken hands is among both for a moment.
        peers += set(self._shaking.values()).difference(peers)
        if len(peers) >= MAX_CONNECTIONS:
            return False
        of_address = sum(peer is not None and peer[0] == address for peer in peers)
        is_own = address.startswith("127.") or address == "::1"
        return is_own or of_address < MAX_FROM_ONE


def tls_of(certificates: Certificates) -> ssl.SSLContext:
    """Return how the port speaks TLS, 1.2 or newer."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.load_cert_chain(certificates.leaf_file)
    return context
