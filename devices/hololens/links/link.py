"""A thread that keeps one port of the headset connected: what breaks is tried again."""

from __future__ import annotations

import threading
from collections.abc import Callable

from devices.clock import Clock
from devices.hololens.links.connection import Connection, HeadsetError, StoppedError
from devices.hololens.links.health import StreamHealth
from devices.hololens.wire.taking import WireError
from scenes.workers.task import Task

FIRST_WAIT_S = 0.1
"""Seconds to the second attempt; each later wait is twice the one before, up to a limit."""

CLOSE_S = 5.0
"""Seconds that `close` waits for the thread, which looks every 0.1 s but while it connects."""

SILENT_S = 3.0
"""A stream that says nothing for so long is connected anew."""

Talk = Callable[[Connection], None]
"""Uses a connection until it breaks or is stopped."""

Prepare = Callable[[threading.Event], None]
"""Makes the headset ready to be connected to; is to end once the event is set."""


class Link:
    """Connects to a port again and again; starts at once.

    Args:
        address: host and port.
        clock: session time.
        health: takes what happens.
        talk: uses each connection, on the link's thread.
        name: of the thread.
        retry_s: longest wait between two attempts.
        prepare: called before each connection, on the link's thread.
        silent_s: see `Connection`.
        silent_hint: see `Connection`.
    """

    def __init__(
        self,
        address: tuple[str, int],
        clock: Clock,
        *,
        health: StreamHealth,
        talk: Talk,
        name: str,
        retry_s: float,
        prepare: Prepare | None = None,
        silent_s: float = SILENT_S,
        silent_hint: str = "",
    ) -> None:
        self._address, self._clock, self._health = address, clock, health
        self._talk, self._prepare, self._retry_s = talk, prepare, retry_s
        self._silent_s, self._silent_hint = silent_s, silent_hint
        self.task = Task(name, self._run)
        self.task.start()

    def close(self) -> None:
        """Hang up; waits for the thread.

        Raises:
            RuntimeError: it did not end within `CLOSE_S`.
        """
        self.task.cancel()
        if not self.task.join(CLOSE_S):
            raise RuntimeError(f"{self.task.name}: did not end within {CLOSE_S:g} s")

    def _run(self, task: Task[None]) -> None:
        first_s = min(FIRST_WAIT_S, self._retry_s)
        wait_s = first_s
        while not task.is_cancelled:
            before = self._health.status().received
            try:
                self._connect_and_talk(task)
                text = "the headset ended the stream"
            except StoppedError:
                break
            except (HeadsetError, WireError) as error:
                text = str(error)
                if isinstance(error, WireError):
                    self._health.damaged(text)
            if self._health.status().received > before:
                wait_s = first_s
            self._health.waits(f"{text}; trying again")
            if task.pause(wait_s):
                break
            wait_s = min(2 * wait_s, self._retry_s)
        self._health.closed()

    def _connect_and_talk(self, task: Task[None]) -> None:
        if self._prepare is not None:
            self._prepare(task.cancelled)
        connection = Connection(
            self._address,
            self._clock,
            stop=task.cancelled,
            silent_s=self._silent_s,
            silent_hint=self._silent_hint,
        )
        try:
            self._health.connected(f"connected to {self._address[0]}:{self._address[1]}")
            self._talk(connection)
        finally:
            connection.close()
