"""The network between a camera and the studio, which fails on command: for TCP and for UDP.

A black hole is the worst kind: what was connected before it stays open, says nothing for ever, and
never learns that it is dead. Loopback only.
"""

from __future__ import annotations

import selectors
import socket
import threading
from contextlib import suppress
from dataclasses import dataclass, field

from scenes.workers.task import Task

WAIT_S = 0.02
"""How often the relay looks for a command, seconds: how late a fault may begin."""

READ_BYTES = 1 << 16
"""Bytes taken at a time."""

CONNECT_S = 1.0
"""How long the far end may take to accept."""

HELD_BYTES = 1 << 16
"""Bytes that wait for a slow side, at most: a camera's own buffer is hardly more."""


@dataclass(slots=True, eq=False)
class _Side:
    socket: socket.socket
    waiting: bytearray = field(default_factory=bytearray)
    other: _Side | None = None


class TcpRelay:
    """Connects whoever comes to `target`, until `close`.

    Args:
        target: host and port of whoever listens.

    Raises:
        OSError: no port is free.
    """

    def __init__(self, target: tuple[str, int]) -> None:
        self.target = target
        """Where new connections lead."""
        self.connections = 0
        """Connections so far."""
        self._is_hole = False
        self._lock = threading.Lock()
        self._sides: dict[int, _Side] = {}
        self._dead: list[socket.socket] = []
        self._garbage = b""
        self._selector = selectors.DefaultSelector()
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=32)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, HELD_BYTES)
        self._listener.setblocking(False)
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._task = Task("TCP relay", self._run)
        self._task.start()

    @property
    def address(self) -> tuple[str, int]:
        """Address that it listens at."""
        host, port = self._listener.getsockname()[:2]
        return host, port

    def begin_hole(self) -> None:
        """From now on nothing passes, and what is open or comes meanwhile is dead for ever."""
        with self._lock:
            self._is_hole = True
            self._kill()

    def end_hole(self) -> None:
        """Connections made from now on work; the dead ones stay open and silent."""
        with self._lock:
            self._is_hole = False

    def half_open(self) -> None:
        """Leave every open connection dead for ever, without a word; new ones work."""
        with self._lock:
            self._kill()

    def cut(self) -> None:
        """Close everything that is open, as a camera that is switched off in order does."""
        with self._lock:
            for side in list(self._sides.values()):
                self._drop(side)

    def send_garbage(self, data: bytes) -> None:
        """Put bytes into the next piece of every stream that leaves the camera's side."""
        with self._lock:
            self._garbage = data

    def close(self) -> None:
        """Stop, and close everything."""
        self._task.cancel()
        self._task.join()
        self.cut()
        for dead in self._dead:
            dead.close()
        self._selector.close()
        self._listener.close()

    def _kill(self) -> None:
        for side in self._sides.values():
            self._selector.unregister(side.socket)
            self._dead.append(side.socket)
        self._sides.clear()

    def _run(self, task: Task[None]) -> None:
        while not task.is_cancelled:
            ready = self._selector.select(WAIT_S)
            with self._lock:
                for key, _ in ready:
                    if key.fileobj is self._listener:
                        self._accept()
                    elif (side := self._sides.get(key.fd)) is not None:
                        self._pass_on(side)
                for side in list(self._sides.values()):
                    self._send(side)

    def _accept(self) -> None:
        accepted, _from = self._listener.accept()
        self.connections += 1
        if self._is_hole:
            self._dead.append(accepted)
            return
        try:
            far = socket.create_connection(self.target, CONNECT_S)
        except OSError:
            accepted.close()
            return
        near_side, far_side = _Side(accepted), _Side(far)
        near_side.other, far_side.other = far_side, near_side
        for side in (near_side, far_side):
            side.socket.setblocking(False)
            side.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._sides[side.socket.fileno()] = side
            self._selector.register(side.socket, selectors.EVENT_READ)

    def _pass_on(self, side: _Side) -> None:
        other = side.other
        if other is None or len(other.waiting) > HELD_BYTES:
            return
        try:
            data = side.socket.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._send(other)
            self._drop(side)
            return
        if self._garbage and len(data) > len(self._garbage):
            data, self._garbage = self._garbage + data, b""
        other.waiting += data
        self._send(other)

    def _send(self, side: _Side) -> None:
        if not side.waiting:
            return
        try:
            sent = side.socket.send(side.waiting)
        except BlockingIOError:
            return
        except OSError:
            self._drop(side)
            return
        del side.waiting[:sent]

    def _drop(self, side: _Side) -> None:
        for each in (side, side.other):
            if each is None or self._sides.pop(each.socket.fileno(), None) is None:
                continue
            self._selector.unregister(each.socket)
            each.socket.close()


class UdpRelay:
    """Passes datagrams on to `target`, until `close`.

    Args:
        target: host and port of whoever receives them.
    """

    def __init__(self, target: tuple[str, int]) -> None:
        self._target = target
        self._is_hole = False
        self._garbage = b""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(WAIT_S)
        self._task = Task("UDP relay", self._run)
        self._task.start()

    @property
    def address(self) -> tuple[str, int]:
        """Address that it receives at."""
        host, port = self._socket.getsockname()[:2]
        return host, port

    def begin_hole(self) -> None:
        """From now on nothing passes."""
        self._is_hole = True

    def end_hole(self) -> None:
        """Let pass what comes from now on."""
        self._is_hole = False

    def send_garbage(self, data: bytes) -> None:
        """Send bytes of our own once, as if they came from the camera."""
        self._garbage = data

    def close(self) -> None:
        """Stop."""
        self._task.cancel()
        self._task.join()
        self._socket.close()

    def _run(self, task: Task[None]) -> None:
        while not task.is_cancelled:
            with suppress(OSError):
                data = self._socket.recv(READ_BYTES)
                if self._is_hole:
                    continue
                if self._garbage:
                    garbage, self._garbage = self._garbage, b""
                    self._socket.sendto(garbage, self._target)
                self._socket.sendto(data, self._target)
