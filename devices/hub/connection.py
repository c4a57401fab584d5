"""One client's WebSocket: what comes is handed to the session, what waits is sent at its pace."""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Callable
from contextlib import suppress

from aiohttp import WSCloseCode, WSMessage, WSMsgType, web

from devices.clock import Clock
from devices.hub.attendance import Visit
from devices.hub.channels import to_text
from devices.hub.entry.admission import Refused
from devices.hub.media.voice_wire import VOICE_KIND
from devices.hub.outbox import Outbox
from devices.hub.protocol.fields import MessageError
from devices.hub.protocol.messages import MAX_TEXT_BYTES, Hello, OpError, read_message
from devices.hub.session import Session

HELLO_S = 10.0
"""Time for the first message; chosen: a phone on a bad network."""

PING_NS = 2 * 10**9
"""Time between pings, which measure the latency and show that somebody is there."""

SILENT_NS = 10 * 10**9
"""Silence after which a connection is taken for broken: five pings without an answer."""

STUCK_NS = 10 * 10**9
"""Time that a message may take to leave this machine."""

MAX_WAITING_BYTES = 32 * 1024
"""Bytes that wait below the outbox, where nothing newer can replace them: 50 ms at 5 Mbit/s."""

_VOICE = bytes([VOICE_KIND])
"""Second byte of a moment of voice."""

_STAMP = struct.Struct("<Q")
"""Content of a ping: session time."""


class Connection:
    """A client from its first message to its last.

    Args:
        session: what everybody shares.
        clock: session time.
        peers: all connections, this one among them.
    """

    def __init__(self, session: Session, *, clock: Clock, peers: Peers) -> None:
        self._session, self._clock, self._peers = session, clock, peers
        self._socket = web.WebSocketResponse(
            autoping=False, compress=False, max_msg_size=MAX_TEXT_BYTES, writer_limit=1, timeout=2.0
        )
        self._news = asyncio.Event()
        self._timer: asyncio.TimerHandle | None = None
        self._outbox: Outbox | None = None
        self._transport: asyncio.Transport | None = None
        self._heard_ns = self._pinged_ns = clock.now_ns()
        self._sending_since_ns: int | None = None
        self._pongs: list[bytes] = []

    def wake(self) -> None:
        """Look for news to send. On the loop's thread."""
        self._news.set()

    def wake_for_bodies(self, now_ns: int) -> None:
        """Look for bodies as soon as they are due. On the loop's thread."""
        if self._timer is not None or self._outbox is None:
            return
        pause_ns = self._outbox.next_body_ns - now_ns
        if pause_ns <= 0:
            self._news.set()
        else:
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(pause_ns * 1e-9, self._end_pause)

    def check(self, now_ns: int) -> None:
        """Give up a client that is silent, or that takes nothing."""
        sending_ns = self._sending_since_ns
        is_stuck = sending_ns is not None and now_ns - sending_ns > STUCK_NS
        if (is_stuck or now_ns - self._heard_ns > SILENT_NS) and self._transport is not None:
            self._transport.abort()
        elif now_ns - self._pinged_ns >= PING_NS:
            self.wake()

    async def serve(self, request: web.BaseRequest, address: str) -> web.WebSocketResponse:
        """Talk to a client until either side ends it; return the finished response."""
        await self._socket.prepare(request)
        transport = request.transport
        if transport is None:
            return self._socket
        self._transport = transport
        _keep_little_waiting(transport)
        try:
            hello = await self._first_message()
            with self._session.lock:
                visit = self._session.enter(hello, address=address, now_ns=self._clock.now_ns())
        except (Refused, MessageError) as error:
            await self._say_goodbye(str(error))
            return self._socket
        self._outbox = visit.outbox
        self._peers.wake()
        sender = asyncio.ensure_future(self._send_all(visit.outbox))
        try:
            await self._hear_all(visit)
        finally:
            with self._session.lock:
                self._session.leave(visit, self._clock.now_ns())
            self._outbox = None
            self._peers.wake()
            sender.cancel()
            with suppress(asyncio.CancelledError):
                await sender
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
        return self._socket

    async def _first_message(self) -> Hello:
        try:
            message = await self._socket.receive(HELLO_S)
            found = read_message(message.data) if message.type is WSMsgType.TEXT else None
        except (TimeoutError, OpError) as error:
            raise MessageError("the first message has to be hello") from error
        if not isinstance(found, Hello):
            raise MessageError("the first message has to be hello")
        return found

    async def _hear_all(self, visit: Visit) -> None:
        while not self._socket.closed:
            message = await self._socket.receive()
            if message.type in (WSMsgType.CLOSE, WSMsgType.CLOSING, WSMsgType.CLOSED):
                return
            if message.type is WSMsgType.ERROR:
                with self._session.lock:
                    self._session.fault(visit, "no WebSocket message", now_ns=self._clock.now_ns())
                return
            self._heard_ns = self._clock.now_ns()
            self._hear(visit, message)

    def _hear(self, visit: Visit, message: WSMessage) -> None:
        now_ns = self._heard_ns
        session = self._session
        if message.type is WSMsgType.BINARY and message.data[1:2] == _VOICE:
            with session.lock:
                is_news = session.hear_voice(visit, message.data, now_ns=now_ns)
            if is_news or visit.outbox.is_ending:
                self._peers.wake()
        elif message.type is WSMsgType.BINARY:
            with session.lock:
                is_news = session.see_body(visit, message.data, now_ns=now_ns)
            if is_news:
                for peer in self._peers.connections:
                    if peer is not self:
                        peer.wake_for_bodies(now_ns)
            elif visit.outbox.is_ending:
                self.wake()
        elif message.type is WSMsgType.TEXT:
            with session.lock:
                is_news = session.hear(visit, message.data, now_ns=now_ns)
            if is_news:
                self._peers.wake()
            else:
                self.wake()
        elif message.type is WSMsgType.PING:
            self._pongs = [bytes(message.data)]
            self.wake()
        elif message.type is WSMsgType.PONG and len(message.data) == _STAMP.size:
            sent_ns: int = _STAMP.unpack(message.data)[0]
            if sent_ns == self._pinged_ns:
                with session.lock:
                    visit.guest.measure(now_ns - sent_ns)

    async def _send_all(self, outbox: Outbox) -> None:
        """Send what waits; wait; again, until the outbox has ended or the client is gone."""
        session, clock, news = self._session, self._clock, self._news
        with suppress(ConnectionError, RuntimeError):  # it has closed: the reader ends, too
            while True:
                news.clear()
                now_ns = clock.now_ns()
                self._sending_since_ns = now_ns
                await self._send_control(now_ns)
                while True:
                    with session.lock:
                        message = outbox.take(
                            session.states,
                            session.bodies,
                            now_ns=clock.now_ns(),
                            pictures=session.pictures,
                            mesh=session.mesh,
                        )
                    if message is None:
                        break
                    self._sending_since_ns = clock.now_ns()
                    if isinstance(message, str):
                        await self._socket.send_str(message)
                    else:
                        await self._socket.send_bytes(message)
                self._sending_since_ns = None
                if outbox.is_ending:
                    await self._socket.close(code=WSCloseCode.POLICY_VIOLATION)
                    return
                await news.wait()

    async def _send_control(self, now_ns: int) -> None:
        if self._pongs:
            await self._socket.pong(self._pongs.pop())
        if now_ns - self._pinged_ns >= PING_NS:
            self._pinged_ns = now_ns
            await self._socket.ping(_STAMP.pack(now_ns))

    def _end_pause(self) -> None:
        self._timer = None
        self._news.set()

    async def _say_goodbye(self, why: str) -> None:
        with suppress(ConnectionError, RuntimeError):
            await self._socket.send_str(to_text({"kind": "bye", "why": why}))
            await self._socket.close(code=WSCloseCode.POLICY_VIOLATION)


class Peers:
    """Connections of a hub. They are woken on their loop; `soon` is said on any thread.

    Args:
        clock: session time.

    Attributes:
        connections: those that are there.
        loop: on which they are; None before it runs.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.connections: set[Connection] = set()
        self.loop: asyncio.AbstractEventLoop | None = None

    def wake(self) -> None:
        """Let every one look at what is to be sent."""
        for connection in self.connections:
            connection.wake()

    def wake_soon(self) -> None:
        """Let every one look soon."""
        self.call_soon(self.wake)

    def wake_for_bodies_soon(self) -> None:
        """Let every one look at bodies soon."""
        self.call_soon(self._wake_for_bodies)

    def call_soon(self, call: Callable[[], None]) -> None:
        """Call something on the loop; not at all where it does not run."""
        loop = self.loop
        if loop is not None and not loop.is_closed():
            with suppress(RuntimeError):  # it closed in between
                loop.call_soon_threadsafe(call)

    def _wake_for_bodies(self) -> None:
        now_ns = self._clock.now_ns()
        for connection in self.connections:
            connection.wake_for_bodies(now_ns)


def _keep_little_waiting(transport: asyncio.Transport) -> None:
    """Let messages wait in the outbox, where the newest wins, not in the system's buffers."""
    transport.set_write_buffer_limits(high=MAX_WAITING_BYTES)
    wire = transport.get_extra_info("socket")
    option = getattr(socket, "TCP_NOTSENT_LOWAT", None)
    if wire is not None and option is not None:
        with suppress(OSError):
            wire.setsockopt(socket.IPPROTO_TCP, option, MAX_WAITING_BYTES)
