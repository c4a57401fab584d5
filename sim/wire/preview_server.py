"""A simulated Insta360 camera's TCP port 6666: the same bytes, fed with H.264 access units.

One client at a time: a new one takes over, so a client that lost its connection finds its way back
at once. Loopback unless another address is given; the protocol has no password.
"""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from random import Random

from devices.clock import Clock
from devices.insta360.commands import (
    BAD_REQUEST,
    FAILED,
    NOT_IMPLEMENTED,
    OK,
    CameraInfo,
    Command,
    info_reply,
    read_get_options,
    read_set_time,
    read_start_live,
)
from devices.insta360.errors import CameraProtocolError
from devices.insta360.packets import (
    VIDEO,
    KeepAlive,
    Message,
    Packet,
    PacketParser,
    Stream,
    Sync,
    encode,
)
from devices.insta360.protobuf import ProtobufError, bytes_field, message, varint_field
from devices.messages import EncodedFrame
from scenes.workers.task import Task
from sim.wire.accepting import AcceptingPort, send_all

Feed = Callable[[], Iterator[EncodedFrame]]
"""Called once a preview; yields access units in order of time, beginning with a keyframe."""

SILENCE_S = 10.0
"""How long a client may say nothing before the camera hangs up, as real ones do."""

SEND_S = 5.0
"""How long a client may take nothing before the camera hangs up."""

WAIT_S = 0.2
"""How often threads look whether they are to end."""

CLOSE_S = 5.0
"""How long `close` waits for a thread that is inside the feed."""

GARBAGE_BYTES = 4096
"""Size of a piece of garbage between packets."""

MAX_ABANDONED = 8
"""Connections that are kept open after the camera vanished from them; the oldest is closed."""

_UNKNOWN_COMMAND, _UNKNOWN_BODY, _EXECUTE = 1, 2, 3
"""Numbers of the camera's errors, as in the vendor's message definitions."""


@dataclass(frozen=True, slots=True)
class PreviewFaults:
    """Faults of the camera and of the way to it; may be exchanged while it runs.

    Attributes:
        delay_s: every picture is sent that much later.
        jitter_s: and up to that much more, at random.
        frozen: no pictures, but replies.
        half_open: nothing is sent or read, but the connection stays.
        garbage: random bytes before every picture.
        drift_ppm: the camera's clock runs that much too fast.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    frozen: bool = False
    half_open: bool = False
    garbage: bool = False
    drift_ppm: float = 0.0


class PreviewServer:
    """Listens from the start until `close`.

    Args:
        feed: where access units come from.
        clock: session time; units are sent at their pace.
        info: what the camera says of itself.
        host: address to listen at.
        port: 0 for any free one.
        seed: of jitter and garbage.
        tick_ns: unit of its time stamps: a millisecond, as of an X4.
        paced: whether units are sent at the pace of their times; else as soon as the feed yields
            them.

    Attributes:
        faults: what is wrong now.

    Raises:
        OSError: the port is taken.
    """

    def __init__(
        self,
        feed: Feed,
        clock: Clock,
        info: CameraInfo,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        seed: int = 0,
        tick_ns: int = 1_000_000,
        paced: bool = True,
    ) -> None:
        self.faults = PreviewFaults()
        self._feed, self._clock, self._info, self._seed = feed, clock, info, seed
        self._tick_ns, self._paced = tick_ns, paced
        self._port = AcceptingPort(host, port, name="camera 6666")
        self._client: _Client | None = None
        self._abandoned: deque[_Client] = deque()
        self.connections = 0
        """Clients so far."""
        self.sent_units = 0
        """Access units handed to the network so far."""
        self.set_times: tuple[int, int] | None = None
        """Clock as a client set it last: seconds since 1970 and east of Greenwich."""
        self._port.start(self._accept)

    @property
    def address(self) -> tuple[str, int]:
        """Address at which it listens."""
        return self._port.address

    def close(self) -> None:
        """Hang up and stop listening; waits for the threads. Harmless when closed."""
        self._port.close()
        for client in (*self._abandoned, self._client):
            if client is not None:
                client.close()

    def abandon(self) -> None:
        """Leave the present client alone for good, its connection open: a camera that vanished.

        Another client finds the camera as if it had just been switched on.
        """
        client, self._client = self._client, None
        if client is not None:
            client.vanish()
            self._abandoned.append(client)
        while len(self._abandoned) > MAX_ABANDONED:
            self._abandoned.popleft().close()

    def _accept(self, connection: socket.socket) -> None:
        if self._client is not None:
            self._client.close()
        self.connections += 1
        self._client = _Client(self, connection, Random(self._seed + self.connections))

    def reply(self, command: Message) -> Message:
        """Answer a command; starting and stopping is left to the caller."""
        try:
            body = self._body(command)
        except ProtobufError as error:
            return _refused(command, BAD_REQUEST, _UNKNOWN_BODY, str(error))
        if body is None:
            return _refused(command, NOT_IMPLEMENTED, _UNKNOWN_COMMAND, "unknown command")
        return Message(OK, command.seq, body)

    def _body(self, command: Message) -> bytes | None:
        match command.code:
            case Command.GET_OPTIONS:
                return info_reply(self._info, read_get_options(command.body))
            case Command.SET_OPTIONS:
                self.set_times = read_set_time(command.body) or self.set_times
                return b""
            case Command.START_LIVE_STREAM:
                read_start_live(command.body)
                return b""
            case Command.STOP_LIVE_STREAM | Command.GET_CAPTURE_STATUS:
                return b""
            case _:
                return None

    def units(self) -> Iterator[tuple[int, EncodedFrame]]:
        """Access units at their pace, and when each was due on the session's clock."""
        begun: tuple[int, int] | None = None
        for frame in self._feed():
            if not self._paced:
                yield self._clock.now_ns(), frame
                continue
            begun = begun or (self._clock.now_ns(), frame.t_ns)
            due_ns = begun[0] + frame.t_ns - begun[1]
            self._clock.sleep_until(due_ns)
            yield due_ns, frame

    def stamp(self, t_ns: int) -> int:
        """A capture time as the camera's clock has it."""
        return round(t_ns * (1 + 1e-6 * self.faults.drift_ppm) / self._tick_ns)

    def sleep_until(self, t_ns: int) -> None:
        """Wait on the session's clock."""
        self._clock.sleep_until(t_ns)


def _refused(command: Message, code: int, error: int, words: str) -> Message:
    body = message(varint_field(1, error), bytes_field(2, words))
    return Message(code, command.seq, body)


class _Client:
    """One connection: a thread that reads, and one that sends video while a preview runs."""

    def __init__(self, server: PreviewServer, connection: socket.socket, random: Random) -> None:
        self._server, self._socket, self._random = server, connection, random
        self._socket.settimeout(WAIT_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._sending = threading.Lock()
        self._reader = Task("camera 6666 reads", self._read)
        self._vanished = threading.Event()
        self._preview: Task[None] | None = None
        self._reader.start()

    def close(self) -> None:
        """Hang up and wait for the threads."""
        self._reader.cancel()
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._reader.join(CLOSE_S)

    def vanish(self) -> None:
        """Send and read nothing any more, without hanging up."""
        self._vanished.set()

    def _read(self, _task: Task[None]) -> None:
        parser, silent_s = PacketParser(), 0.0
        try:
            while not self._reader.is_cancelled and silent_s < SILENCE_S:
                if self._server.faults.half_open or self._vanished.is_set():
                    self._reader.pause(WAIT_S)
                    continue
                try:
                    data = self._socket.recv(1 << 16)
                except TimeoutError:
                    silent_s += WAIT_S
                    continue
                silent_s = 0.0
                if not data:
                    break
                for packet in parser.feed(data):
                    self._take(packet)
        except (OSError, CameraProtocolError):
            pass  # the client broke off or sends garbage: the camera hangs up
        finally:
            self._stop_preview()
            self._socket.close()

    def _take(self, packet: Packet) -> None:
        if isinstance(packet, Sync | KeepAlive):
            self._send(packet)
        elif isinstance(packet, Message):
            reply = self._server.reply(packet)
            if packet.code == Command.STOP_LIVE_STREAM:
                self._stop_preview()
            self._send(reply)
            if packet.code == Command.START_LIVE_STREAM and reply.code == OK:
                self._start_preview()

    def _start_preview(self) -> None:
        self._stop_preview()
        self._preview = Task("camera 6666 sends", self._stream).start()

    def _stop_preview(self) -> None:
        if self._preview is not None:
            preview, self._preview = self._preview, None
            preview.cancel()
            preview.join(CLOSE_S)

    def _stream(self, task: Task[None]) -> None:
        try:
            for due_ns, frame in self._server.units():
                if task.is_cancelled or self._reader.is_cancelled or self._vanished.is_set():
                    return
                faults = self._server.faults
                if faults.frozen or faults.half_open:
                    continue
                late_s = faults.delay_s + faults.jitter_s * self._random.random()
                if late_s > 0:
                    self._server.sleep_until(due_ns + round(1e9 * late_s))
                if faults.garbage:
                    self._send_bytes(self._random.randbytes(GARBAGE_BYTES))
                stamp = self._server.stamp(frame.t_ns)
                self._send(Stream(VIDEO, stamp, frame.data))
                self._server.sent_units += 1
        except OSError:
            self._reader.cancel()
        except CameraProtocolError as error:
            body = message(varint_field(1, _EXECUTE), bytes_field(2, str(error)))
            with suppress(OSError):
                self._send(Message(FAILED, 0, body))

    def _send(self, packet: Packet) -> None:
        self._send_bytes(encode(packet))

    def _send_bytes(self, data: bytes) -> None:
        """All of it, or `OSError` when the client takes nothing for `SEND_S`."""
        with self._sending:
            send_all(self._socket, data, wait_s=WAIT_S, limit_s=SEND_S, sender=self._reader)
