"""How packets get to a player: between the replies of its connection, or over UDP."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from random import Random
from typing import Protocol

from sim.wire.rtsp.packets import MAX_BYTES, Packetiser
from sim.wire.rtsp.transport import OverTcp, OverUdp

REPORT_NS = 5_000_000_000
"""Between two reports, nanoseconds: RFC 3550's shortest interval."""

BURST = 32
"""Packets over UDP that leave at once, 44 kB: a receiver has room for 212 kB (Linux's default)."""

PAUSE_S = 0.001
"""Between two bursts, seconds: a keyframe of 300 kB takes 7 ms of a picture's 33."""


class Sender(Protocol):
    """One player's stream of packets."""

    @property
    def header(self) -> str:
        """The transport, as a reply names it."""
        ...

    def begin(self, random: Random) -> None:
        """Number the stream, as RFC 3550 wants it: at random."""
        ...

    def send(self, data: bytes, t_ns: int, *, lost: bool, loss: float) -> bool:
        """An access unit's packets; whether any left. Raises `OSError` when the player is gone."""
        ...

    def send_garbage(self, data: bytes) -> None:
        """Bytes that are no packet."""
        ...

    def report(self, t_ns: int, wall_ns: int) -> None:
        """The sender's report, if it is time for one."""
        ...

    def close(self) -> None:
        """Give the ports back."""
        ...


class _Numbered:
    """Packet numbers and report times, which both senders have."""

    def __init__(self) -> None:
        self._packetiser = Packetiser(0, 0, 0)
        self._reported_ns: int | None = None
        self._random = Random(0)

    def begin(self, random: Random) -> None:
        """See `Sender.begin`."""
        self._random = random
        self._packetiser = Packetiser(
            random.getrandbits(32), random.getrandbits(16), random.getrandbits(32)
        )

    def _report(self, t_ns: int, wall_ns: int) -> bytes | None:
        last_ns = self._reported_ns
        if last_ns is not None and 0 <= t_ns - last_ns < REPORT_NS:
            return None
        self._reported_ns = t_ns
        return self._packetiser.report(t_ns, wall_ns)


class TcpSender(_Numbered):
    """Between the replies.

    Args:
        transport: the channels.
        send: takes a channel, or None for no frame around, and packets.
    """

    def __init__(self, transport: OverTcp, send: Callable[[int | None, list[bytes]], None]) -> None:
        super().__init__()
        self._transport, self._send = transport, send

    @property
    def header(self) -> str:
        """See `Sender.header`."""
        return self._transport.header

    def send(self, data: bytes, t_ns: int, *, lost: bool, loss: float) -> bool:
        """See `Sender.send`; nothing is lost by the packet here."""
        del loss
        if not lost:
            self._send(self._transport.rtp, list(self._packetiser.packets_of(data, t_ns)))
        return not lost

    def send_garbage(self, data: bytes) -> None:
        """See `Sender.send_garbage`."""
        self._send(None, [data])

    def report(self, t_ns: int, wall_ns: int) -> None:
        """See `Sender.report`."""
        report = self._report(t_ns, wall_ns)
        if report is not None:
            self._send(self._transport.rtcp, [report])

    def close(self) -> None:
        """See `Sender.close`."""


class UdpSender(_Numbered):
    """Over a pair of ports of its own.

    Args:
        transport: the player's ports.
        host: address to send from.
        peer: the player's address.

    Raises:
        OSError: there is no port free.
    """

    def __init__(self, transport: OverUdp, host: str, peer: str) -> None:
        super().__init__()
        self._transport, self._peer = transport, peer
        self._closed = threading.Event()
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._rtp = socket.socket(family, socket.SOCK_DGRAM)
        self._rtcp = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._rtp.bind((host, 0))
            self._rtcp.bind((host, 0))
        except OSError:
            self.close()
            raise

    @property
    def header(self) -> str:
        """See `Sender.header`."""
        ports = [each.getsockname()[1] for each in (self._rtp, self._rtcp)]
        return f"{self._transport.header};server_port={ports[0]}-{ports[1]}"

    def send(self, data: bytes, t_ns: int, *, lost: bool, loss: float) -> bool:
        """See `Sender.send`; packets are lost here one by one."""
        del lost
        sent = 0
        for number, packet in enumerate(self._packetiser.packets_of(data, t_ns)):
            if number and number % BURST == 0:
                self._closed.wait(PAUSE_S)
            if loss and self._random.random() < loss:
                continue
            self._to(self._rtp, packet, self._transport.rtp)
            sent += 1
        return sent > 0

    def send_garbage(self, data: bytes) -> None:
        """See `Sender.send_garbage`."""
        self._to(self._rtp, data[:MAX_BYTES], self._transport.rtp)

    def report(self, t_ns: int, wall_ns: int) -> None:
        """See `Sender.report`."""
        report = self._report(t_ns, wall_ns)
        if report is not None:
            self._to(self._rtcp, report, self._transport.rtcp)

    def close(self) -> None:
        """See `Sender.close`."""
        self._closed.set()
        self._rtp.close()
        self._rtcp.close()

    def _to(self, sender: socket.socket, data: bytes, port: int) -> None:
        # A player that has closed its port says so at its connection, too, which is what counts.
        with suppress(OSError):
            sender.sendto(data, (self._peer, port))
