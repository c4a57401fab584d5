"""The RTMP port: one camera at a time may push, everybody else is refused with a word.

One thread, no blocking call: a half-open connection, a slow greeting or garbage cost a bounded time
and a bounded number of bytes.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from devices.camera.address import CameraAddress
from devices.camera.annex_b import BitstreamError
from devices.camera.rtmp.chunks import RtmpError
from devices.camera.rtmp.session import RtmpSession, Stage
from devices.camera.units import IDLE_S, Idle, SourceError, Unit
from devices.clock import Clock

SILENT_S = 4.0
"""Seconds without a byte after which a publisher is given up as half-open.

A camera that comes back within 5 s of the network must find the port free; OBS, FFmpeg and phones
send at least one picture a second.
"""

REPLACED_AFTER_S = 1.0
"""Seconds without a byte after which a second publisher takes the place of the first: the camera
itself, back on a new connection before the old one is known to be dead. Whoever asks sooner waits
for that long at most, for many cameras give up when they are refused once."""

IN_FLIGHT_S = 0.2
"""Seconds after a second publisher has asked from which bytes of the first show that it lives: what
was on its way when it vanished has arrived by then."""

GREETING_S = 5.0
"""Seconds from a connection to its first published picture, else it is closed."""

MAX_CONNECTIONS = 16
"""Connections that are held at a time, the publisher's among them."""

READ_BYTES = 1 << 18
"""Bytes read at a time: several pictures at 50 Mbit/s and 30 Hz."""

MAX_UNSENT_BYTES = 1 << 16
"""Replies that a peer may leave unread; it gets fewer than 1 kB until it publishes."""


@dataclass(slots=True, eq=False)
class _Peer:
    socket: socket.socket
    name: str
    session: RtmpSession
    since_ns: int
    heard_ns: int
    asked_ns: int = 0
    unsent: bytearray = field(default_factory=bytearray)


class RtmpListener:
    """A `Source`: listens on a port until it is closed.

    Args:
        address: an RTMP address; its path is the `application/key` that is accepted, any if empty.
        clock: session time.

    Raises:
        SourceError: the port cannot be listened on.
    """

    tracks = 1

    def __init__(self, address: CameraAddress, clock: Clock) -> None:
        self._wanted = address.path
        self._clock = clock
        self._peers: dict[int, _Peer] = {}
        self._publisher: _Peer | None = None
        self._units: list[Unit] = []
        self._lost = ""
        self.refused = 0
        """Connections that were closed without having published."""
        self.last_refusal = ""
        """Why the last one was, with its address."""
        self._selector = selectors.DefaultSelector()
        self._socket = _listening(address)
        # Kept, since a window may ask after the socket is closed.
        self._bound_host, self._bound_port = self._socket.getsockname()[:2]
        self._selector.register(self._socket, selectors.EVENT_READ)

    @property
    def port(self) -> int:
        """The port it listens on, also where the address asked for any free one."""
        return int(self._bound_port)

    def units(self, stop: threading.Event) -> Iterator[Unit | Idle]:
        """Pictures of one publisher, until it leaves.

        Raises:
            SourceError: the publisher left, fell silent or sent what cannot be received.
        """
        while not stop.is_set():
            self._turn()
            if self._units:
                units, self._units = self._units, []
                yield from units
                continue
            lost, self._lost = self._lost, ""
            if lost:
                raise SourceError(lost)
            publisher = self._publisher
            if publisher is None:
                yield Idle(f"waiting for a camera to push to {self.shown}", connected=False)
            else:
                yield Idle(f"{publisher.name} is connected", connected=True)

    @property
    def shown(self) -> str:
        """The address for the camera, with the port that it really is."""
        host = str(self._bound_host)
        host = "THIS-COMPUTER" if host in ("0.0.0.0", "::") else host
        return f"rtmp://{host}:{self.port}/{self._wanted or 'live/any'}"

    def close(self) -> None:
        """Close every connection and the port."""
        for peer in list(self._peers.values()):
            self._drop(peer)
        self._selector.close()
        self._socket.close()

    def _turn(self) -> None:
        """Wait for bytes, at most `IDLE_S`, and take them."""
        for key, _ in self._selector.select(IDLE_S):
            if key.fileobj is self._socket:
                self._accept()
            elif (peer := self._peers.get(key.fd)) is not None:
                self._read(peer)
        self._settle_waiting()
        self._drop_late()

    def _accept(self) -> None:
        try:
            accepted, where = self._socket.accept()
        except OSError:
            return
        name = str(where[0])
        if len(self._peers) >= MAX_CONNECTIONS:
            self._make_room()
        accepted.setblocking(False)
        with contextlib.suppress(OSError):
            accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        now_ns = self._clock.now_ns()
        peer = _Peer(accepted, name, RtmpSession(self._admit), now_ns, now_ns)
        self._peers[accepted.fileno()] = peer
        self._selector.register(accepted, selectors.EVENT_READ)

    def _make_room(self) -> None:
        """Close the oldest connection that publishes nothing, of the host that has most of them.

        Whoever opens many connections and says nothing keeps no camera out.
        """
        others = [peer for peer in self._peers.values() if peer is not self._publisher]
        counts = Counter(peer.name for peer in others)
        self._end(
            min(others, key=lambda peer: (-counts[peer.name], peer.since_ns)),
            f"more than {MAX_CONNECTIONS} connections",
        )

    def _admit(self, path: str) -> str | None:
        """Why nobody may publish to `path`; empty if somebody may, None if it is not known yet."""
        if self._wanted and path != self._wanted:
            return f"this studio waits for {self._wanted!r}, not for {path!r}"
        holder = self._publisher
        if holder is None:
            return ""
        if self._clock.now_ns() - holder.heard_ns < REPLACED_AFTER_S * 1e9:
            return None
        self._drop(holder)
        return ""

    def _settle_waiting(self) -> None:
        """Admit whoever waits once the publisher is gone or silent, refuse them once it is not."""
        for peer in [peer for peer in self._peers.values() if peer.session.waiting]:
            holder, now_ns = self._publisher, self._clock.now_ns()
            if holder is None:
                peer.session.settle("")
            elif holder.heard_ns > peer.asked_ns + IN_FLIGHT_S * 1e9:
                peer.session.settle(f"{holder.name} is already pushing; stop it first")
            elif now_ns - holder.heard_ns >= REPLACED_AFTER_S * 1e9:
                self._drop(holder)
                peer.session.settle("")
            else:
                continue
            self._after(peer, was_published=False)

    def _read(self, peer: _Peer) -> None:
        try:
            data = peer.socket.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._end(peer, f"the connection of {peer.name} broke ({error.strerror or error})")
            return
        if not data:
            self._end(peer, f"{peer.name} closed the connection")
            return
        was_published = peer.session.stage is Stage.PUBLISHING
        try:
            units = peer.session.take(data)
        except (RtmpError, BitstreamError) as error:
            self._end(peer, f"{peer.name}: {error}")
            return
        peer.heard_ns = self._clock.now_ns()
        self._units += units
        if peer.session.waiting and not peer.asked_ns:
            peer.asked_ns = peer.heard_ns
        self._after(peer, was_published=was_published)

    def _after(self, peer: _Peer, *, was_published: bool) -> None:
        """Do as a peer's new stage asks."""
        if peer.session.stage is Stage.PUBLISHING and not was_published:
            self._publisher = peer
        self._send(peer)
        if peer.session.stage is Stage.ENDED:
            self._end(peer, peer.session.refusal or f"{peer.name} ended its stream")

    def _send(self, peer: _Peer) -> None:
        """Send replies as far as the socket takes them; the rest goes with the next bytes."""
        peer.unsent += peer.session.replies()
        if not peer.unsent:
            return
        try:
            sent = peer.socket.send(peer.unsent)
        except OSError:
            sent = 0
        del peer.unsent[:sent]
        if len(peer.unsent) > MAX_UNSENT_BYTES:
            self._end(peer, f"{peer.name} does not read the replies")

    def _drop_late(self) -> None:
        now_ns = self._clock.now_ns()
        for peer in list(self._peers.values()):
            if peer is self._publisher:
                if now_ns - peer.heard_ns > SILENT_S * 1e9:
                    self._end(peer, f"{peer.name} sent nothing for {SILENT_S:g} s")
            elif now_ns - peer.since_ns > GREETING_S * 1e9:
                self._end(peer, f"nothing published within {GREETING_S:g} s")

    def _end(self, peer: _Peer, why: str) -> None:
        if peer is self._publisher:
            self._lost = why
        else:
            self._note_refusal(peer.name, why)
        self._drop(peer)

    def _note_refusal(self, name: str, why: str) -> None:
        self.refused += 1
        self.last_refusal = why if why.startswith(name) else f"{name}: {why}"

    def _drop(self, peer: _Peer) -> None:
        if peer is self._publisher:
            self._publisher = None
        if self._peers.pop(peer.socket.fileno(), None) is not None:
            self._selector.unregister(peer.socket)
        peer.socket.close()


def _listening(address: CameraAddress) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((address.host or "0.0.0.0", address.port))
        listening.listen(MAX_CONNECTIONS)
    except (OSError, OverflowError) as error:
        listening.close()
        reason = getattr(error, "strerror", None) or error
        raise SourceError(
            f"{address.shown}: port {address.port} cannot be listened on ({reason}); stop what "
            "uses it, or give another port or rtmp://:PORT/… for every interface",
            is_final=True,
        ) from None
    listening.setblocking(False)
    return listening
