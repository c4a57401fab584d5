"""A listening TCP port whose thread hands out its connections, and sending on one of them."""

from __future__ import annotations

import socket
from collections.abc import Callable

from scenes.workers.task import Task

WAIT_S = 0.1
"""Longest wait for a connection, seconds: how soon a close is noticed."""


class AcceptingPort:
    """Listens from the beginning, hands out connections from `start` until `close`.

    Args:
        host: where to listen.
        port: 0 for any free one.
        name: of the thread.

    Raises:
        OSError: the port is taken.
    """

    def __init__(self, host: str, port: int, *, name: str) -> None:
        self._listener = socket.create_server((host, port), backlog=16)
        self._listener.settimeout(WAIT_S)
        bound_host, bound_port = self._listener.getsockname()[:2]
        self._address = str(bound_host), int(bound_port)
        self._taken: Callable[[socket.socket], None] | None = None
        self._task = Task(name, self._run)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port, also after `close`."""
        return self._address

    def start(self, taken: Callable[[socket.socket], None]) -> None:
        """Hand every connection to `taken`, on the port's thread, which it may keep busy."""
        self._taken = taken
        self._task.start()

    def close(self) -> None:
        """Stop listening; waits for the thread. Harmless when closed."""
        self._task.cancel()
        self._task.join()
        self._listener.close()

    def _run(self, task: Task[None]) -> None:
        while not task.is_cancelled:
            try:
                connection, _from = self._listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return  # the listener is closed
            assert self._taken is not None
            self._taken(connection)


def send_all(
    connection: socket.socket,
    data: bytes,
    *,
    wait_s: float,
    limit_s: float,
    sender: Task[None],
) -> None:
    """Send all of some bytes.

    Args:
        connection: its timeout is `wait_s`.
        data: to send.
        wait_s: time after which it is looked whether to go on.
        limit_s: time for which the other side may take nothing.
        sender: ends it when cancelled.

    Raises:
        OSError: the other side is gone, takes nothing, or the sender was cancelled meanwhile.
    """
    rest, waited_s = memoryview(data), 0.0
    while rest:
        try:
            rest = rest[connection.send(rest) :]
            waited_s = 0.0
        except TimeoutError:
            waited_s += wait_s
            if waited_s >= limit_s or sender.is_cancelled:
                raise
