"""One WebSocket to a hub: pairing, hello and welcome, messages both ways."""

from __future__ import annotations

import json
import ssl
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast
from urllib.parse import urlsplit

import aiohttp

ANSWER_S = 10.0
"""Longest wait for an answer of the hub."""

MAX_MESSAGE_BYTES = 16 * 1024 * 1024
"""Largest message that a client takes: a welcome with every line that a hub keeps is a tenth."""


class HubRefusedError(Exception):
    """The hub does not let somebody in; its reason, and the HTTP status where there is one."""

    def __init__(self, why: str, *, status: int | None = None) -> None:
        super().__init__(why)
        self.status = status


@dataclass(frozen=True, slots=True)
class HubAddress:
    """Address of a hub.

    Attributes:
        url: of its page, such as "https://192.168.1.5:8443/".
        trusted: file of the root certificate that is trusted; None for the system's own.

    Raises:
        ValueError: it is no such address.
    """

    url: str
    trusted: Path | None = None

    def __post_init__(self) -> None:
        parts = urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"hub {self.url!r}: wanted http://HOST:PORT or https://HOST:PORT")

    def at(self, path: str, *, is_socket: bool = False) -> str:
        """Return the address of a path."""
        parts = urlsplit(self.url)
        scheme = {"http": "ws", "https": "wss"}[parts.scheme] if is_socket else parts.scheme
        return f"{scheme}://{parts.netloc}{path}"

    def opened(self) -> aiohttp.ClientSession:
        """Return a new HTTP session for any number of people; used as a context manager.

        Raises:
            ValueError: the root certificate cannot be read.
        """
        tls: ssl.SSLContext | bool = True
        if self.trusted is not None:
            try:
                tls = ssl.create_default_context(cafile=str(self.trusted))
            except (OSError, ssl.SSLError) as error:
                raise ValueError(f"{self.trusted}: no root certificate: {error}") from None
        return aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=0, ssl=tls))


async def fetch_page(http: aiohttp.ClientSession, address: HubAddress) -> int:
    """Return the length of the hub's page, bytes.

    Raises:
        HubRefusedError: it is not given.
        aiohttp.ClientError, TimeoutError, OSError: the hub is not reached.
    """
    async with http.get(address.at("/"), timeout=_timeout()) as answer:
        if answer.status != 200:
            raise HubRefusedError(f"page: HTTP {answer.status}", status=answer.status)
        return len(await answer.read())


async def pair(
    http: aiohttp.ClientSession,
    address: HubAddress,
    *,
    code: str,
    name: str,
    origin: str | None = None,
) -> str:
    """Return a token for a code.

    Raises:
        HubRefusedError: the code is not accepted.
        aiohttp.ClientError, TimeoutError, OSError: the hub is not reached.
    """
    headers = {} if origin is None else {"Origin": origin}
    body = {"code": code, "name": name}
    async with http.post(
        address.at("/pair"), json=body, headers=headers, timeout=_timeout()
    ) as answer:
        said = _object(await answer.text())
        if answer.status != 200:
            raise HubRefusedError(str(said.get("why", "pairing refused")), status=answer.status)
        return str(said["token"])


class HubConnection:
    """A WebSocket after its welcome.

    Attributes:
        welcome: the hub's first message.
    """

    def __init__(self, socket: aiohttp.ClientWebSocketResponse, welcome: dict[str, Any]) -> None:
        self.welcome = welcome
        self._socket = socket

    @property
    def is_closed(self) -> bool:
        """Whether nothing goes through any more."""
        return self._socket.closed

    async def send(self, fields: Mapping[str, Any]) -> None:
        """Send a text message.

        Raises:
            ConnectionError: it is closed.
        """
        await self._socket.send_str(json.dumps(fields, separators=(",", ":")))

    async def send_bytes(self, data: bytes) -> None:
        """Send a binary message.

        Raises:
            ConnectionError: it is closed.
        """
        await self._socket.send_bytes(data)

    async def receive(self) -> dict[str, Any] | bytes | None:
        """Return the next message; None once the connection is closed."""
        message = await self._socket.receive()
        if message.type is aiohttp.WSMsgType.TEXT:
            return _object(message.data)
        if message.type is aiohttp.WSMsgType.BINARY:
            return cast(bytes, message.data)
        return None

    async def close(self) -> None:
        """Close it."""
        await self._socket.close()


async def connect(
    http: aiohttp.ClientSession,
    address: HubAddress,
    *,
    token: str,
    name: str,
    log_seq: int | None = None,
    origin: str | None = None,
) -> HubConnection:
    """Return a connection that the hub has welcomed.

    Args:
        http: of `HubAddress.opened`.
        address: of the hub.
        token: of pairing, or the newest that the hub has given.
        name: shown to the others.
        log_seq: newest entry of the log that is known; None for none.
        origin: of the page that connects; None for a program.

    Raises:
        HubRefusedError: the hub does not let somebody in.
        aiohttp.ClientError, TimeoutError, OSError: the hub is not reached.
    """
    hello: dict[str, Any] = {"kind": "hello", "token": token, "name": name}
    if log_seq is not None:
        hello["log_seq"] = log_seq
    url = address.at("/people", is_socket=True)
    try:
        socket = await http.ws_connect(url, origin=origin, max_msg_size=MAX_MESSAGE_BYTES)
    except aiohttp.WSServerHandshakeError as error:
        raise HubRefusedError(error.message, status=error.status) from None
    try:
        await socket.send_str(json.dumps(hello))
        message = await socket.receive(ANSWER_S)
    except BaseException:
        await socket.close()
        raise
    if message.type is aiohttp.WSMsgType.TEXT:
        said = _object(message.data)
        if said.get("kind") == "welcome":
            return HubConnection(socket, said)
        why = str(said.get("why", "no welcome"))
    else:
        why = "the hub closed the connection"
    await socket.close()
    raise HubRefusedError(why)


def _timeout() -> aiohttp.ClientTimeout:
    return aiohttp.ClientTimeout(total=ANSWER_S)


def _object(text: str) -> dict[str, Any]:
    try:
        value: Any = json.loads(text)
    except ValueError:
        return {}
    return cast(dict[str, Any], value) if isinstance(value, dict) else {}
