"""A small RTSP server: one stream, several players, over TCP or UDP.

Loopback unless another address is given; there is no password.
"""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from random import Random
from typing import Protocol
from urllib.parse import urlsplit

from scenes.workers.task import Task
from sim.wire.accepting import AcceptingPort, send_all
from sim.wire.rtsp.requests import (
    Interleaved,
    Request,
    RequestReader,
    RtspError,
    interleaved,
    reply,
)
from sim.wire.rtsp.senders import Sender, TcpSender, UdpSender
from sim.wire.rtsp.transport import OverTcp, read_transport

MAX_CLIENTS = 8
"""Players at a time; further ones are sent away."""

MAX_ABANDONED = 8
"""Connections that are kept open after the camera vanished from them; the oldest is closed."""

WAIT_S = 0.1
"""How often threads look whether they are to end."""

IDLE_S = 10.0
"""How long a client that is sent nothing may say nothing, seconds."""

MAX_LOOKS = 600
"""How often a client is listened to before it is sent packets: a minute of silence in steps of
`WAIT_S`, or as many pieces. Players take ten; one that sends a byte at a time is sent away."""

SESSION_S = 60
"""How long a player that is sent packets may say nothing, seconds: RTSP's usual timeout, which
the answer names. Over TCP players report every few seconds."""

SEND_S = 5.0
"""How long a player may take nothing before the camera hangs up."""

METHODS = "OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN, GET_PARAMETER"
"""Methods that can be asked for."""


@dataclass(frozen=True, slots=True)
class StreamUnit:
    """An access unit for a player.

    Attributes:
        t_ns: its time on the camera's clock.
        data: H.264 Annex B.
        is_lost: whether it is lost as a whole.
        loss: share of its packets that are lost, over UDP.
    """

    t_ns: int
    data: bytes
    is_lost: bool = False
    loss: float = 0.0


class Viewing(Protocol):
    """The packets for one player."""

    def take(self, timeout_s: float) -> StreamUnit | None:
        """The next unit; None if there is none in time. The first one is a keyframe."""
        ...

    def sent(self, unit: StreamUnit) -> None:
        """A unit was handed to the network."""
        ...

    def close(self) -> None:
        """The player has left."""
        ...


@dataclass(frozen=True, slots=True)
class RtspFaults:
    """Faults of the camera; may be exchanged while it runs.

    Attributes:
        silent: nothing is sent or read, but connections stay.
        garbage_bytes: random bytes before every picture.
    """

    silent: bool = False
    garbage_bytes: int = 0


@dataclass(frozen=True, slots=True)
class RtspStream:
    """The stream that is served.

    Attributes:
        path: of its URL, without the first slash.
        describe: gives the session's description for an address of the server.
        view: begins a player's viewing.
        wall_ns: nanoseconds since 1970, for reports.
    """

    path: str
    describe: Callable[[str], str]
    view: Callable[[], Viewing]
    wall_ns: Callable[[], int]


class RtspServer:
    """Listens from the start until `close`.

    Args:
        stream: what is served.
        host: address to listen at.
        port: 0 for any free one.
        random: of session and stream numbers, lost packets and garbage.

    Attributes:
        faults: what is wrong now.

    Raises:
        OSError: the port is taken.
    """

    def __init__(
        self, stream: RtspStream, random: Random, *, host: str = "127.0.0.1", port: int = 0
    ) -> None:
        self.faults = RtspFaults()
        self.stream = stream
        self._random = random
        self._port = AcceptingPort(host, port, name="camera RTSP")
        self._lock = threading.Lock()
        self._clients: list[_Client] = []
        self._abandoned: deque[_Client] = deque()
        self.connections = 0
        """Clients so far."""
        self.refused = 0
        """Of these, sent away because there were too many."""
        self.plays = 0
        """How often a player began to be sent packets."""
        self._port.start(self._accept)

    @property
    def address(self) -> tuple[str, int]:
        """Address at which it listens."""
        return self._port.address

    def close(self) -> None:
        """Hang up and stop listening; waits for the threads. Harmless when closed."""
        self._port.close()
        with self._lock:
            clients = (*self._clients, *self._abandoned)
            self._clients.clear()
            self._abandoned.clear()
        for client in clients:
            client.close()

    def abandon(self) -> None:
        """Leave all clients alone for good, their connections open: a camera that vanished."""
        with self._lock:
            for client in self._clients:
                client.vanish()
                self._abandoned.append(client)
            self._clients.clear()
            old = [self._abandoned.popleft() for _ in range(len(self._abandoned) - MAX_ABANDONED)]
        for client in old:
            client.close()

    def _accept(self, connection: socket.socket) -> None:
        self.connections += 1
        with self._lock:
            self._clients = [client for client in self._clients if client.is_alive]
            if len(self._clients) < MAX_CLIENTS:
                random = Random(self._random.getrandbits(64))
                self._clients.append(_Client(self, connection, random))
                return
        self.refused += 1
        with connection, suppress(OSError):
            connection.settimeout(WAIT_S)
            connection.sendall(reply(503, 0))


class _Client:
    """One connection: a thread that reads, and one that sends while it plays."""

    def __init__(self, server: RtspServer, connection: socket.socket, random: Random) -> None:
        self._server, self._socket, self._random = server, connection, random
        self._socket.settimeout(WAIT_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._sending = threading.Lock()
        self._reader = Task("camera RTSP reads", self._read)
        self._vanished = threading.Event()
        self._session = f"{random.getrandbits(64):016x}"
        self._sender: Sender | None = None
        self._player: Task[None] | None = None
        self._reader.start()

    @property
    def is_alive(self) -> bool:
        """Whether the connection stands."""
        return self._reader.is_running

    def vanish(self) -> None:
        """Send and read nothing any more, without hanging up."""
        self._vanished.set()

    def close(self) -> None:
        """Hang up and wait for the threads."""
        self._reader.cancel()
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._reader.join(2 * SEND_S)

    @property
    def _is_silent(self) -> bool:
        return self._server.faults.silent or self._vanished.is_set()

    def _read(self, _task: Task[None]) -> None:
        requests, silent_s, looks = RequestReader(), 0.0, 0
        try:
            while not self._reader.is_cancelled:
                looks += self._player is None
                if looks > MAX_LOOKS:
                    return
                if silent_s >= (IDLE_S if self._player is None else SESSION_S):
                    return
                if self._is_silent:
                    self._reader.pause(WAIT_S)
                    continue
                try:
                    data = self._socket.recv(1 << 14)
                except TimeoutError:
                    silent_s += WAIT_S
                    continue
                silent_s = 0.0
                if not data or not self._take(requests.feed(data)):
                    return
        except RtspError:
            with suppress(OSError):
                self.send(reply(400, 0))
        except OSError:
            pass  # the player broke off
        finally:
            self._hang_up()

    def _hang_up(self) -> None:
        self._reader.cancel()
        if self._player is not None:
            self._player.join(2 * SEND_S)
        if self._sender is not None:
            self._sender.close()
        self._socket.close()

    def _take(self, found: list[Request | Interleaved]) -> bool:
        """Answer requests; whether the connection goes on."""
        for each in found:
            if isinstance(each, Interleaved):
                continue  # a player's report
            self.send(self._answer(each))
            if each.method == "TEARDOWN":
                return False
            if each.method == "PLAY" and self._sender is not None:
                self._play(self._sender)
        return True

    def _answer(self, request: Request) -> bytes:
        cseq = request.cseq
        if "require" in request.headers:
            wanted = request.headers["require"][:100]
            return reply(551, cseq, {"Unsupported": wanted})
        if request.method == "OPTIONS":
            return reply(200, cseq, {"Public": METHODS})
        if not _is_below(request.url, self._server.stream.path):
            return reply(404, cseq)
        session = request.headers.get("session", "").partition(";")[0].strip()
        if session and session != self._session:
            return reply(454, cseq)
        given = {"Session": f"{self._session};timeout={SESSION_S}"}
        match request.method:
            case "DESCRIBE":
                return self._describe(request)
            case "SETUP":
                return self._set_up(request, given)
            case "PLAY" | "TEARDOWN" if self._sender is None or not session:
                return reply(455, cseq)
            case "PLAY":
                return reply(200, cseq, {**given, "Range": "npt=now-"})
            case "TEARDOWN":
                return reply(200, cseq)
            case "GET_PARAMETER":
                return reply(200, cseq, given if self._sender is not None else {})
            case _:
                return reply(405, cseq, {"Allow": METHODS})

    def _describe(self, request: Request) -> bytes:
        host = self._socket.getsockname()[0]
        headers = {
            "Content-Type": "application/sdp",
            "Content-Base": request.url.rstrip("/") + "/",
        }
        return reply(200, request.cseq, headers, self._server.stream.describe(host))

    def _set_up(self, request: Request, given: dict[str, str]) -> bytes:
        if self._sender is not None:
            return reply(455, request.cseq)
        transport = read_transport(request.headers.get("transport", ""))
        if transport is None:
            return reply(461, request.cseq)
        if isinstance(transport, OverTcp):
            self._sender = TcpSender(transport, self._send_packets)
        else:
            peer = self._socket.getpeername()[0]
            try:
                self._sender = UdpSender(transport, self._socket.getsockname()[0], peer)
            except OSError:
                return reply(503, request.cseq)
        return reply(200, request.cseq, {**given, "Transport": self._sender.header})

    def _play(self, sender: Sender) -> None:
        if self._player is not None:
            return  # it plays
        self._server.plays += 1
        self._player = Task("camera RTSP sends", lambda _: self._stream(sender)).start()

    def _stream(self, sender: Sender) -> None:
        viewing = self._server.stream.view()
        sender.begin(self._random)
        try:
            while not self._reader.is_cancelled:
                unit = viewing.take(WAIT_S)
                if unit is None or self._is_silent:
                    continue
                garbage = self._server.faults.garbage_bytes
                if garbage:
                    sender.send_garbage(self._random.randbytes(garbage))
                if sender.send(unit.data, unit.t_ns, lost=unit.is_lost, loss=unit.loss):
                    viewing.sent(unit)
                sender.report(unit.t_ns, self._server.stream.wall_ns())
        except OSError:
            pass  # the player broke off, or takes nothing
        finally:
            viewing.close()
            self._reader.cancel()

    def _send_packets(self, channel: int | None, packets: list[bytes]) -> None:
        """Packets between replies; without a channel, bytes as they are."""
        if channel is None:
            self.send(b"".join(packets))
        else:
            self.send(b"".join(interleaved(channel, packet) for packet in packets))

    def send(self, data: bytes) -> None:
        """All of it, or `OSError` when the player takes nothing for `SEND_S`."""
        with self._sending:
            send_all(self._socket, data, wait_s=WAIT_S, limit_s=SEND_S, sender=self._reader)


def _is_below(url: str, path: str) -> bool:
    """Whether a URL is the stream's, its track's, or "*"."""
    if url == "*":
        return True
    try:
        asked = urlsplit(url).path.strip("/")
    except ValueError:
        return False
    return asked == path or asked == f"{path}/trackID=0"
