"""A port that serves one client at a time; others wait to be taken, and get no bytes till then."""

from __future__ import annotations

import socket
from collections.abc import Callable
from contextlib import suppress
from random import Random

from devices.hololens.wire.taking import WireError
from sim.hololens.faults import HoloLensFaultKind
from sim.hololens.world import Counts, HeadsetWorld
from sim.wire.accepting import AcceptingPort

WAIT_S = 0.1
"""How often a waiting port looks whether it is to end."""

WITHIN_S = 10.0
"""Longest wait for the rest of a message that has begun; whoever stops there is hung up on."""

SEND_S = 5.0
"""Longest wait for a client that takes nothing."""

CHUNK_BYTES = 1 << 16
"""Bytes received at a time: memory grows with what has come."""


class GuestLeftError(Exception):
    """The client is gone, or is to go."""


class Guest:
    """One client, for the port's thread.

    Args:
        connection: to it.
        world: clock and faults.
        random: of delays.
    """

    def __init__(self, connection: socket.socket, world: HeadsetWorld, *, random: Random) -> None:
        self._socket, self.world, self.random = connection, world, random
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._is_within = False

    def message_ended(self) -> None:
        """Begin another message, for which the client may take its time."""
        self._is_within = False

    def take(self, count: int) -> bytes:
        """Receive exactly so many bytes.

        Raises:
            GuestLeftError: the client is gone, or stopped within a message.
        """
        data = bytearray()
        waited_s = 0.0
        while len(data) < count:
            if self.world.is_hung_up():
                raise GuestLeftError
            self._socket.settimeout(WAIT_S)
            try:
                piece = self._socket.recv(min(count - len(data), CHUNK_BYTES))
            except TimeoutError:
                waited_s += WAIT_S
                if self._is_within and waited_s > WITHIN_S:
                    raise GuestLeftError from None
                continue
            except OSError:
                raise GuestLeftError from None
            if not piece:
                raise GuestLeftError
            data += piece
            waited_s, self._is_within = 0.0, True
        return bytes(data)

    def wait_for_end(self, longest_s: float) -> None:
        """Wait until the client hangs up."""
        until_s = self.world.now_s() + longest_s
        while self.world.now_s() < until_s and not self.world.is_hung_up():
            self._socket.settimeout(WAIT_S)
            with suppress(TimeoutError):
                try:
                    if not self._socket.recv(CHUNK_BYTES):
                        return
                except ConnectionError:
                    return

    def delay(self) -> None:
        """Wait as long as one way takes now."""
        faults, t_s = self.world.faults, self.world.now_s()
        late_s = faults.size_of(HoloLensFaultKind.DELAY, t_s)
        late_s += faults.size_of(HoloLensFaultKind.JITTER, t_s) * self.random.random()
        if late_s > 0:
            self.world.clock.sleep_until(self.world.clock.now_ns() + round(1e9 * late_s))

    def send(self, data: bytes) -> None:
        """Send all of it, late where there are faults.

        Raises:
            GuestLeftError: the client is gone, or takes nothing.
        """
        self.delay()
        self.reply(data)

    def reply(self, data: bytes) -> None:
        """Send all of it, without a delay.

        Raises:
            GuestLeftError: as `send`.
        """
        while self.world.is_stalled() and not self.world.is_hung_up():
            self.world.stop.wait(WAIT_S / 2)
        if self.world.is_hung_up():
            raise GuestLeftError
        self._socket.settimeout(SEND_S)
        try:
            self._socket.sendall(data)
        except OSError:
            raise GuestLeftError from None


Serve = Callable[[Guest], None]
"""Serves one client until it leaves."""


class HeadsetPort:
    """A listening port; serves from the beginning until `close`.

    Args:
        place: host and port, 0 for any free one.
        world: what all ports share; its `stop` ends this one, too.
        serve: called with each client, on the port's thread.
        name: of the thread.
        counts: of what it does.

    Attributes:
        counts: what it did so far.

    Raises:
        OSError: the port is taken.
    """

    def __init__(
        self,
        place: tuple[str, int],
        world: HeadsetWorld,
        *,
        serve: Serve,
        name: str,
        counts: Counts,
    ) -> None:
        self.counts = counts
        self._world, self._serve = world, serve
        self._random = Random(f"{world.seed} {name}")
        self._port = AcceptingPort(*place, name=name)
        self._port.start(self._take)

    @property
    def number(self) -> int:
        """The real number of the port."""
        return self._port.address[1]

    def close(self) -> None:
        """Stop listening; waits for the thread, which the world's `stop` has ended."""
        self._port.close()

    def _take(self, connection: socket.socket) -> None:
        with connection:
            if self._world.is_hung_up():
                return
            self.counts.connections += 1
            try:
                self._serve(Guest(connection, self._world, random=self._random))
            except (GuestLeftError, OSError):
                pass  # as clients do: they hang up when they have enough
            except WireError:
                self.counts.refused += 1  # as the headset does: it hangs up
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
