"""A connection to one port of the headset: bytes in the number that is asked for, or an error."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress

from devices.clock import Clock

CHUNK_BYTES = 1 << 16
"""Bytes received at a time; memory grows with what has come, not with what was promised."""

WAIT_S = 0.1
"""How often a waiting connection looks whether it is to end."""

CONNECT_S = 3.0
"""Longest wait for a connection, seconds, chosen: a headset on Wi-Fi answers within 0.1 s."""

SEND_S = 3.0
"""Longest wait for room to send, seconds."""


class HeadsetError(ValueError):
    """The headset, or the way to it, failed: names the address and what to do."""


class HeadsetLeftError(HeadsetError):
    """The connection broke, or none came about."""


class HeadsetSilentError(HeadsetError):
    """The headset is connected and sends nothing."""


class StoppedError(Exception):
    """The connection is to end; nothing failed."""


class Connection:
    """One TCP connection, for one thread.

    Args:
        address: host and port.
        clock: session time.
        stop: set once it is to end.
        silent_s: longest wait for the next byte.
        silent_hint: what to do when none comes.

    Raises:
        HeadsetLeftError: nothing answers.
    """

    def __init__(
        self,
        address: tuple[str, int],
        clock: Clock,
        *,
        stop: threading.Event,
        silent_s: float,
        silent_hint: str = "",
    ) -> None:
        self._where = f"{address[0]}:{address[1]}"
        self._clock, self._stop = clock, stop
        self._silent_s, self._silent_hint = silent_s, silent_hint
        self.received_bytes = 0
        """Bytes so far."""
        try:
            self._socket = socket.create_connection(address, CONNECT_S)
        except OSError as error:
            raise HeadsetLeftError(
                f"{self._where}: nothing answers ({error.strerror or error}); start the streaming "
                "app on the headset and check its address"
            ) from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    @property
    def is_stopped(self) -> bool:
        """Whether it is to end."""
        return self._stop.is_set()

    def pause(self, seconds: float) -> None:
        """Wait.

        Raises:
            StoppedError: it is to end.
        """
        if self._stop.wait(seconds):
            raise StoppedError

    def send(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            HeadsetLeftError: the connection broke.
        """
        try:
            self._socket.settimeout(SEND_S)
            self._socket.sendall(data)
        except OSError as error:
            raise self._broken(error.strerror or str(error)) from None

    def take(self, count: int) -> bytes:
        """Receive exactly so many bytes.

        Raises:
            HeadsetLeftError: the connection broke.
            HeadsetSilentError: none came for `silent_s`.
            StoppedError: it is to end.
        """
        data = bytearray()
        heard_ns = self._clock.now_ns()
        self._socket.settimeout(WAIT_S)
        while len(data) < count:
            try:
                piece = self._socket.recv(min(count - len(data), CHUNK_BYTES))
            except TimeoutError:
                if self._stop.is_set():
                    raise StoppedError from None
                if self._clock.now_ns() - heard_ns > 1e9 * self._silent_s:
                    raise HeadsetSilentError(
                        f"{self._where}: connected, but nothing came for {self._silent_s:g} s"
                        f"{self._silent_hint}"
                    ) from None
                continue
            except OSError as error:
                raise self._broken(error.strerror or str(error)) from None
            if not piece:
                raise self._broken("the headset hung up")
            data += piece
            heard_ns = self._clock.now_ns()
        if self._stop.is_set():
            raise StoppedError
        self.received_bytes += count
        return bytes(data)

    def check(self) -> None:
        """Nothing, where the other side is there and says nothing.

        Raises:
            HeadsetLeftError: it hung up, or sends what nobody asked for.
        """
        self._socket.settimeout(1e-3)
        try:
            data = self._socket.recv(1)
        except TimeoutError:
            return
        except OSError as error:
            raise self._broken(error.strerror or str(error)) from None
        raise self._broken("it sends what nobody asked for" if data else "the headset hung up")

    def is_over(self, wait_s: float) -> bool:
        """Wait for the other side's end; return whether it came."""
        self._socket.settimeout(max(wait_s, 1e-3))
        with suppress(TimeoutError):
            try:
                return not self._socket.recv(CHUNK_BYTES)
            except ConnectionError:
                return True
        return False

    def close(self) -> None:
        """Hang up."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _broken(self, why: str) -> HeadsetLeftError:
        return HeadsetLeftError(f"{self._where}: the connection broke ({why})")
