"""MPEG-TS over UDP as a stream of bytes: one sender at a time, other senders' packets are dropped.

A thread empties the socket, for a keyframe comes faster than a socket's buffer holds.
"""

from __future__ import annotations

import ipaddress
import socket
import threading
import time
from collections import deque

from devices.camera.units import SourceError
from scenes.workers.task import Task

PACKET_BYTES, SYNC = 188, 0x47
"""Size of a packet of a transport stream, and its first byte (ISO/IEC 13818-1, 2.4.3.2)."""

MAX_DATAGRAM_BYTES = 65507
"""Longest payload of UDP over IPv4."""

SOCKET_BYTES = 4 << 20
"""Asked of the system for the socket's buffer; it gives what it allows, often 208 kB."""

MAX_HELD_BYTES = 8 << 20
"""Bytes that wait for the reader, at most: 2.7 s at 24 Mbit/s. The oldest are dropped."""

SENDER_GONE_S = 0.5
"""Seconds without a packet after which another sender may take over: a camera that starts again has
another port. 15 pictures at 30 Hz; a sender that comes back meanwhile is kept."""

WAIT_S = 0.1
"""How often the thread looks whether it is to end."""


class TsDatagrams:
    """Received datagrams, for FFmpeg to read instead of a socket of its own.

    Args:
        host: interface or multicast group to listen at; empty for every interface.
        port: UDP port.

    Attributes:
        refused: datagrams that were no transport stream, or of another sender.

    Raises:
        SourceError: the port is taken, or the address is not of this computer.
    """

    def __init__(self, host: str, port: int) -> None:
        self.refused = 0
        self._sender: tuple[str, int] | None = None
        self._sender_s = 0.0
        self._held: deque[bytes] = deque()
        self._held_bytes = 0
        self._changed = threading.Condition()
        self._is_closed = False
        self._socket = _bound(host, port)
        self._task = Task("receive UDP", self._receive)
        self._task.start()

    @property
    def port(self) -> int:
        """The port it listens on."""
        return int(self._socket.getsockname()[1])

    def read(self, size: int) -> bytes:
        """Up to `size` bytes, waiting for the first; empty after `close`."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._held) or self._is_closed)
            if not self._held:
                return b""
            data = self._held.popleft()
            self._held_bytes -= len(data)
            if len(data) > size:
                self._held.appendleft(data[size:])
                self._held_bytes += len(data) - size
                data = data[:size]
            return data

    def close(self) -> None:
        """Give the port back; whoever reads gets the end."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        self._task.join()
        self._socket.close()

    def _receive(self, _task: Task[None]) -> None:
        while not self._is_closed:
            try:
                data, sender = self._socket.recvfrom(MAX_DATAGRAM_BYTES)
            except TimeoutError:
                continue
            except OSError:
                continue  # a peer's "port unreachable" is of no interest to a receiver
            if is_transport_stream(data) and self._is_ours(sender, time.monotonic()):
                self._hold(data)
            else:
                self.refused += 1

    def _is_ours(self, sender: tuple[str, int], now_s: float) -> bool:
        """Whether this sender is the one that is received, or takes over from one that is gone."""
        if sender != self._sender and now_s - self._sender_s < SENDER_GONE_S:
            return False
        self._sender, self._sender_s = sender, now_s
        return True

    def _hold(self, data: bytes) -> None:
        with self._changed:
            self._held.append(data)
            self._held_bytes += len(data)
            while self._held_bytes > MAX_HELD_BYTES:
                self._held_bytes -= len(self._held.popleft())
            self._changed.notify_all()


def is_transport_stream(data: bytes) -> bool:
    """Whether a datagram is nothing but whole packets of a transport stream."""
    whole = len(data) > 0 and len(data) % PACKET_BYTES == 0
    return whole and set(data[::PACKET_BYTES]) == {SYNC}


def _bound(host: str, port: int) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SOCKET_BYTES)
        bound.settimeout(WAIT_S)
        if host and ipaddress.ip_address(socket.gethostbyname(host)).is_multicast:
            # Other receivers of a group share its port.
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            bound.bind((host, port))
            group = socket.inet_aton(socket.gethostbyname(host)) + socket.inet_aton("0.0.0.0")
            bound.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
        else:
            bound.bind((host or "0.0.0.0", port))
    except (OSError, OverflowError) as error:
        bound.close()
        reason = getattr(error, "strerror", None) or error
        raise SourceError(
            f"udp://{host}:{port}: cannot be listened on ({reason}); stop what uses the port, or "
            "give another one, or udp://:PORT for every interface",
            is_final=True,
        ) from None
    return bound
