"""Hostile visitors at the ports that a simulated session has opened, while it runs.

The hub's port gets damaged requests and frames of strangers, and damaged frames of a spectator who
was let in; the camera's port gets damaged greetings. Nobody tries codes or publishes a stream:
wrong codes would keep friendly people out for a minute, and whoever may push is the camera.
"""

from __future__ import annotations

import asyncio
import http.client
import socket
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from typing import Any
from urllib.parse import urlsplit

import aiohttp

from devices.camera.rtmp.amf import AmfValue, encode_amf
from devices.camera.rtmp.chunks import HANDSHAKE_BYTES, encode_message
from scenes.workers.task import Task
from sim.headset.connection import HubAddress, HubRefusedError, pair
from sim.wire.hostile import hostile_stream
from sim.wire.people_messages import frame, greeting_of, upgrade, valid_bodies, valid_texts

Address = tuple[str, int]

PAUSE_S = 0.05
"""Seconds between two visits: a session of a minute has them all, and most of it without them."""

PATIENCE_S = 0.1
"""How long a visitor waits for the other side to hang up."""

WITNESS_S = 5.0
"""Longest time for an answer to somebody friendly."""

WELCOME = b'"welcome"'
"""Part of a hub's first message to somebody who is let in."""

BATCH = 25
"""Visits of each kind between two friendly ones."""

DEFECT = "defect"
"""Word by which a hub says that it caught an error of its own."""


@dataclass(frozen=True, slots=True)
class Visited:
    """Hostile visits so far.

    Attributes:
        streams: connections.
        unserved: times that somebody friendly was not served afterwards.
    """

    streams: int = 0
    unserved: int = 0


class Defects:
    """Errors that end threads of this process while it is entered, and those that a hub says.

    Args:
        say: takes a hub's lines of errors; none where no hub is attacked.
    """

    def __init__(self, say: Callable[[str], None] = lambda _line: None) -> None:
        self.count = 0
        self._say = say
        self._before = threading.excepthook

    def __enter__(self) -> Defects:
        self._before = threading.excepthook
        threading.excepthook = self._note
        return self

    def __exit__(self, *_error: object) -> None:
        threading.excepthook = self._before

    def hear(self, line: str) -> None:
        """Take a line of a hub's log."""
        if DEFECT in line:
            self.count += 1
            self._say(line)

    def _note(self, args: threading.ExceptHookArgs, /) -> None:
        self.count += 1
        self._before(args)


def attack_session(
    task: Task[None],
    *,
    hub_url: str,
    code: str,
    camera_port: int,
    visits: int,
    say: Callable[[dict[str, Any]], None],
    seed: int = 0,
) -> None:
    """Visit a session's ports until that many visits of each kind are done, and say how it goes.

    Args:
        task: that it is.
        hub_url: address of the hub's page; only what comes before TLS is visited where it has that.
        code: of an invitation for a spectator.
        camera_port: at which the session waits for a camera that pushes; 0 for none.
        visits: of strangers at the hub, of a spectator in it, and at the camera's port.
        say: takes messages for whoever counts.
        seed: of the first visit.
    """
    parts = urlsplit(hub_url)
    hub = (parts.hostname or "127.0.0.1", parts.port or 80)
    token = _paired(hub_url, code) if parts.scheme == "http" else ""
    streams = unserved = 0
    seeds = count(seed)
    for number in range(1, visits + 1):
        kinds = [(hub, _strangers(hub), b"")]
        kinds += [(hub, _frames(), greeting_of(hub, token))] if token else []
        kinds += [(("127.0.0.1", camera_port), camera_greetings(), b"")] if camera_port else []
        for address, valid, greeting in kinds:
            visit(address, valid, seed=next(seeds), greeting=greeting)
            streams += 1
            if task.pause(PAUSE_S):
                return
        if number % BATCH == 0 or number == visits:
            unserved += parts.scheme == "http" and not is_page_served(hub)
            unserved += bool(camera_port) and not is_camera_greeted(("127.0.0.1", camera_port))
            say({"event": "visited", "streams": streams, "unserved": unserved})


def visit(address: Address, valid: Sequence[bytes], *, seed: int, greeting: bytes) -> None:
    """Send one hostile stream, wait a moment for the other side, hang up.

    Args:
        address: of the port.
        valid: what somebody friendly sends; most of what is sent are damaged copies.
        seed: which stream.
        greeting: sent before it, by somebody who is let in; empty for a stranger.
    """
    with suppress(OSError), socket.create_connection(address, WITNESS_S) as wire:
        wire.settimeout(WITNESS_S)
        if greeting:
            wire.sendall(greeting)
            _wait_for_welcome(wire)
        wire.settimeout(PATIENCE_S)
        for piece in hostile_stream(seed, valid):
            wire.sendall(piece)
        wire.shutdown(socket.SHUT_WR)
        while wire.recv(1 << 16):
            pass


def _wait_for_welcome(wire: socket.socket) -> None:
    """Read up to a hub's welcome; what follows a request too soon is not read as frames."""
    came = b""
    while WELCOME not in came:
        data = wire.recv(1 << 16)
        if not data:
            return
        came = came[-len(WELCOME) :] + data


def is_page_served(address: Address) -> bool:
    """Return whether a hub gives its page."""
    connection = http.client.HTTPConnection(*address, timeout=WITNESS_S)
    try:
        connection.request("GET", "/")
        return connection.getresponse().status == http.client.OK
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


def is_camera_greeted(address: Address) -> bool:
    """Return whether a camera's greeting is answered."""
    with suppress(OSError), socket.create_connection(address, WITNESS_S) as wire:
        wire.settimeout(WITNESS_S)
        wire.sendall(b"\x03" + bytes(HANDSHAKE_BYTES))
        return wire.recv(1) == b"\x03"
    return False


def camera_greetings() -> tuple[bytes, ...]:
    """Return what a camera says before it publishes; one asks for a room that nobody waits for."""
    said: tuple[tuple[AmfValue, ...], ...] = (
        ("connect", 1.0, {"app": "live"}),
        ("createStream", 2.0, None),
        ("publish", 3.0, None, "nobody", "live"),
    )
    pieces = (
        b"\x03" + bytes(HANDSHAKE_BYTES),
        bytes(HANDSHAKE_BYTES),
        encode_message(1, (4096).to_bytes(4, "big"), chunk_bytes=128),
        *(encode_message(20, encode_amf(*words), chunk_bytes=4096) for words in said),
    )
    return (*pieces, b"".join(pieces))


def _strangers(address: Address) -> tuple[bytes, ...]:
    """Return what strangers say to a hub, without a code."""
    page = b"GET / HTTP/1.1\r\nHost: %b:%d\r\n\r\n" % (address[0].encode(), address[1])
    return (page, upgrade(address), upgrade(address) + _frames()[0])


def _frames() -> tuple[bytes, ...]:
    """Return what somebody in a session sends, each kind once."""
    texts = (frame(text, opcode=1) for text in valid_texts())
    return (*texts, *(frame(data, opcode=2) for data in valid_bodies()), frame(bytes(8), opcode=9))


def _paired(hub_url: str, code: str) -> str:
    """Return a token for a code; empty where there is none."""

    async def ask() -> str:
        address = HubAddress(hub_url)
        async with address.opened() as web:
            return await pair(web, address, code=code, name="Hostile")

    try:
        return asyncio.run(ask())
    except (HubRefusedError, aiohttp.ClientError, OSError, TimeoutError):
        return ""
