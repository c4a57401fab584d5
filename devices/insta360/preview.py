"""Live preview of an Insta360 camera over its TCP port 6666: a client in one thread, without hurry.

Order: connect (both sides say the sync words), set the time, ask who it is, start the preview,
then iterate. Keep-alives are sent while iterating. The protocol has neither passwords nor
encryption: use a network that only the session is in.
"""

from __future__ import annotations

import socket
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Self

from devices.clock import Clock
from devices.insta360.access_units import UnitAssembler, VideoUnit
from devices.insta360.camera_time import CameraTime
from devices.insta360.commands import (
    FIRST_NOTIFICATION,
    INFO_OPTIONS,
    OK,
    CameraInfo,
    Command,
    LiveRequest,
    get_options,
    read_info,
    refusal,
    set_time,
    start_live,
)
from devices.insta360.errors import (
    CameraError,
    CameraProtocolError,
    CameraRefusedError,
    CameraTimeoutError,
    CameraUnreachableError,
)
from devices.insta360.packets import (
    PORT,
    VIDEO,
    KeepAlive,
    Message,
    Packet,
    PacketParser,
    Stream,
    Sync,
    encode,
)
from devices.insta360.preview_data import PreviewCounts, PreviewLimits
from devices.insta360.protobuf import ProtobufError
from devices.messages import EncodedFrame

KEEP_ALIVE_S = 2.0
"""The camera hangs up after about 10 s without a word; its own app says something every 2 s."""

MAX_QUEUE_BYTES = 32 << 20
"""Limit of the video that came while a reply was waited for; the oldest is dropped."""

CHUNK_BYTES = 1 << 16
"""Bytes taken from the socket at a time."""

ASIDE_S = 0.5
"""How long `units` waits before it looks whether another thread has called `close`."""

SHUTTING_DOWN = 8197
"""Notification: the camera is being switched off."""


@dataclass(frozen=True, slots=True, eq=False)
class TimedUnit:
    """An access unit and when it arrived, on the session's clock."""

    unit: VideoUnit
    received_ns: int


class PreviewClient:
    """One connection to one camera; after an error make a new one.

    Args:
        host: name or address of the camera.
        port: where it listens.
        clock: session time; it runs while the client waits.
        limits: how long to wait.
    """

    def __init__(
        self,
        host: str,
        port: int = PORT,
        *,
        clock: Clock,
        limits: PreviewLimits | None = None,
    ) -> None:
        self._where = f"camera {host}:{port}"
        self._address = (host, port)
        self._clock = clock
        self._limits = limits or PreviewLimits()
        self._socket: socket.socket | None = None
        self._closed = False
        self._parser = PacketParser()
        self._assembler = UnitAssembler()
        self._time = CameraTime()
        self._units: deque[TimedUnit] = deque()
        self._queued_bytes = 0
        self._seq = 0
        self._reply: Message | None = None
        self._synced = False
        self._leaving = False
        self._sent_ns = self._packet_ns = self._picture_ns = 0
        self._packets = self._bytes = self._taken = self._dropped = self._skipped = 0

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *_raised: object) -> None:
        self.close()

    @property
    def counts(self) -> PreviewCounts:
        """Counts of what came so far."""
        return PreviewCounts(self._packets, self._bytes, self._taken, self._dropped, self._skipped)

    def connect(self) -> None:
        """Open the connection and exchange the sync words.

        Raises:
            CameraUnreachableError: nothing listens there, or it hung up.
            CameraTimeoutError: it does not say the sync words.
            CameraProtocolError: it says something else.
        """
        until_ns = self._clock.now_ns() + round(1e9 * self._limits.connect_s)
        try:
            self._socket = socket.create_connection(self._address, self._limits.connect_s)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except TimeoutError:
            raise CameraUnreachableError(
                f"{self._where}: no answer within {self._limits.connect_s:g} s; is this computer "
                "in the camera's Wi-Fi?"
            ) from None
        except OSError as error:
            raise CameraUnreachableError(
                f"{self._where}: {error.strerror or error}; is the camera on, its Wi-Fi joined, "
                "and the address right?"
            ) from None
        if self._closed:
            self.close()
            raise CameraUnreachableError(f"{self._where}: closed while it connected")
        self._packet_ns = self._clock.now_ns()
        self._send(Sync())
        while not self._synced:
            if not self._pump(until_ns):
                raise CameraTimeoutError(
                    f"{self._where}: connected, but no handshake within "
                    f"{self._limits.connect_s:g} s; another app may hold the camera: close it, or "
                    "switch the camera off and on"
                )

    def set_time(self, unix_s: int, zone_s: int = 0) -> None:
        """Set the camera's clock.

        Args:
            unix_s: seconds since 1970, UTC.
            zone_s: seconds east of Greenwich.

        Raises:
            CameraError: as `ask`.
        """
        self.ask(Command.SET_OPTIONS, set_time(unix_s, zone_s))

    def info(self) -> CameraInfo:
        """Description of the camera by itself, its lenses' calibration included.

        Raises:
            CameraError: as `ask`; the reply cannot be read.
        """
        reply = self.ask(Command.GET_OPTIONS, get_options(INFO_OPTIONS))
        try:
            return read_info(reply)
        except ProtobufError as error:
            raise CameraProtocolError(f"{self._where}: what it says of itself: {error}") from None

    def start(self, request: LiveRequest | None = None) -> None:
        """Start the preview.

        Raises:
            CameraError: as `ask`.
        """
        self.ask(Command.START_LIVE_STREAM, start_live(request or LiveRequest()))
        self._picture_ns = self._clock.now_ns()

    def stop(self) -> None:
        """Stop the preview.

        Raises:
            CameraError: as `ask`.
        """
        self.ask(Command.STOP_LIVE_STREAM, b"")

    def ask(self, command: Command, body: bytes) -> bytes:
        """Send a command and wait for its reply; video that comes meanwhile is kept.

        Returns:
            The reply's body.

        Raises:
            CameraRefusedError: the camera refused; its words are in the message.
            CameraTimeoutError: no reply in time.
            CameraUnreachableError: the connection broke.
            CameraProtocolError: bytes that no camera sends.
        """
        self._seq = self._seq % 0xFFFFFF + 1
        self._reply = None
        self._send(Message(command, self._seq, body))
        until_ns = self._clock.now_ns() + round(1e9 * self._limits.reply_s)
        while self._reply is None:
            if not self._pump(until_ns):
                raise CameraTimeoutError(
                    f"{self._where}: no reply to {command.name} within {self._limits.reply_s:g} s"
                )
        reply = self._reply
        if reply.code != OK:
            raise CameraRefusedError(
                f"{self._where}: refused {command.name} ({refusal(reply)}); end a recording or "
                "another app's preview first"
            )
        return reply.body

    def take(self, wait_s: float) -> TimedUnit | None:
        """The next access unit, waiting for it; None if none came meanwhile, or after `close`.

        Args:
            wait_s: longest wait. Who asks often, with short waits, sees a `close` soon.

        Raises:
            CameraTimeoutError: no picture for longer than `PreviewLimits.picture_s`.
            CameraUnreachableError: the connection broke.
            CameraProtocolError: bytes that no camera sends.
        """
        until_ns = self._clock.now_ns() + round(1e9 * wait_s)
        while not self._units and not self._closed and self._pump(until_ns):
            pass
        now_ns = self._clock.now_ns()
        if self._units:
            taken = self._units.popleft()
            self._queued_bytes -= len(taken.unit.data)
            self._taken += 1
            self._picture_ns = now_ns
            return taken
        if not self._closed and now_ns - self._picture_ns > 1e9 * self._limits.picture_s:
            raise CameraTimeoutError(
                f"{self._where}: connected, but no picture for {self._limits.picture_s:g} s; "
                "start the preview again"
            )
        return None

    def units(self) -> Iterator[TimedUnit]:
        """Access units until `close` is called.

        Raises:
            CameraError: as `take`.
        """
        while not self._closed:
            taken = self.take(ASIDE_S)
            if taken is not None:
                yield taken

    def frames(self, stream_id: str) -> Iterator[EncodedFrame]:
        """`units` as packets of a video stream, with capture times on the session's clock.

        Raises:
            CameraError: as `units`; the video is not H.264.
        """
        for seq, taken in enumerate(self.units()):
            unit = taken.unit
            if unit.codec != "h264":
                raise CameraError(
                    f"{self._where}: the preview is {unit.codec.upper()}, wanted H.264; choose "
                    "H.264 in the camera's settings, or read `units`"
                )
            t_ns = self._time.session_ns(unit.stamp, taken.received_ns)
            yield EncodedFrame(stream_id, seq, t_ns, unit.data, unit.keyframe)

    def close(self) -> None:
        """Hang up. Harmless when closed; another thread may call it to end `units`."""
        self._closed = True
        if self._socket is not None:
            with suppress(OSError):  # the other side was faster
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()

    def _pump(self, until_ns: int) -> bool:
        """Wait for bytes, at most until then; False once that time is over."""
        now_ns = self._clock.now_ns()
        if now_ns >= until_ns:
            return False
        if now_ns - self._sent_ns >= 1e9 * KEEP_ALIVE_S and self._synced:
            self._send(KeepAlive())
        keep_ns = round(1e9 * KEEP_ALIVE_S)
        data = self._receive(min(until_ns - now_ns, keep_ns) / 1e9)
        now_ns = self._clock.now_ns()
        if data:
            self._bytes += len(data)
            try:
                packets = self._parser.feed(data)
                for packet in packets:
                    self._take(packet, now_ns)
            except CameraProtocolError as error:
                raise CameraProtocolError(f"{self._where}: {error}") from None
            if packets:
                self._packet_ns = now_ns
        if not self._parser.held_bytes:
            self._packet_ns = now_ns
        elif now_ns - self._packet_ns > 1e9 * self._limits.packet_s:
            raise CameraTimeoutError(
                f"{self._where}: a packet came in part, its rest not within "
                f"{self._limits.packet_s:g} s; the Wi-Fi is too weak: go nearer"
            )
        return True

    def _receive(self, wait_s: float) -> bytes:
        """Receive what is there, waiting for it; empty when nothing came, or after `close`."""
        if self._socket is None:
            raise CameraUnreachableError(f"{self._where}: not connected; call connect first")
        try:
            self._socket.settimeout(max(wait_s, 1e-3))
            data = self._socket.recv(CHUNK_BYTES)
        except TimeoutError:
            return b""
        except OSError as error:
            if self._closed:
                return b""
            raise self._broken(error.strerror or str(error)) from None
        if not data and not self._closed:
            raise self._broken("it hung up")
        return data

    def _send(self, packet: Packet) -> None:
        if self._socket is None:
            raise CameraUnreachableError(f"{self._where}: not connected; call connect first")
        try:
            self._socket.settimeout(self._limits.reply_s)
            self._socket.sendall(encode(packet))
        except OSError as error:
            if not self._closed:
                raise self._broken(error.strerror or str(error)) from None
        self._sent_ns = self._clock.now_ns()

    def _broken(self, why: str) -> CameraUnreachableError:
        hint = "it was switched off" if self._leaving else "look at its battery and the Wi-Fi"
        return CameraUnreachableError(f"{self._where}: the connection broke ({why}); {hint}")

    def _take(self, packet: Packet, now_ns: int) -> None:
        self._packets += 1
        match packet:
            case Sync():
                self._synced = True
            case Message(code, seq, _body):
                self._leaving = self._leaving or code == SHUTTING_DOWN
                if code < FIRST_NOTIFICATION and seq == self._seq:
                    self._reply = packet
            case Stream(channel, stamp, data) if channel == VIDEO:
                for unit in self._assembler.feed(stamp, data):
                    self._queue(unit, now_ns)
            case KeepAlive():
                pass
            case _:
                self._skipped += 1

    def _queue(self, unit: VideoUnit, now_ns: int) -> None:
        self._units.append(TimedUnit(unit, now_ns))
        self._queued_bytes += len(unit.data)
        while self._queued_bytes > MAX_QUEUE_BYTES:
            self._queued_bytes -= len(self._units.popleft().unit.data)
            self._dropped += 1
