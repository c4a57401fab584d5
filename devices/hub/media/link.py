"""The hub's end of the process of media: begun by the first offer, begun again if it dies."""

from __future__ import annotations

import subprocess
import threading
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.util import find_spec

from devices.hub.media import frames
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.task import Task

MAX_WAITING = 256
"""Frames that wait for the process: a second of voices; of more, the oldest goes."""

AGAIN_NS = 5 * 10**9
"""Time between two beginnings of a process that dies, chosen: a defect costs little."""

END_S = 2.0
"""Longest time that the process may take to end."""

EXTRA = "people-media"
"""Of an installation, that brings WebRTC."""


def is_available() -> bool:
    """Return whether WebRTC is installed; nothing of it is loaded for that."""
    return find_spec("aiortc") is not None


class MediaLink:
    """The process, as the hub speaks with it. `send` and `close` from any thread.

    Args:
        addresses: of this machine, at which it takes connections.
        took: takes kind and content of each of its frames, on a thread.
        died: called once it is gone, on a thread.
    """

    def __init__(
        self,
        addresses: Sequence[str],
        *,
        took: Callable[[int, bytes], None],
        died: Callable[[], None],
    ) -> None:
        self._addresses, self._took, self._died = addresses, took, died
        self._lock = threading.Condition()
        self._orders: deque[bytes] = deque()
        self._rest: deque[bytes] = deque(maxlen=MAX_WAITING)
        self._process: ChildProcess | None = None
        self._begun_ns: int | None = None
        self._works: list[Task[None]] = []
        self._is_over = False

    @property
    def is_running(self) -> bool:
        """Whether there is a process."""
        return self._process is not None

    @property
    def process_id(self) -> int | None:
        """Of the process, while there is one."""
        process = self._process
        return None if process is None else process.process_id

    def begin(self, now_ns: int) -> bool:
        """Begin the process unless it runs; return whether it does.

        Args:
            now_ns: session time.
        """
        with self._lock:
            if self._process is not None or self._is_over:
                return not self._is_over
            if self._begun_ns is not None and now_ns - self._begun_ns < AGAIN_NS:
                return False
            self._begun_ns = now_ns
            try:
                process = ChildProcess(
                    module_command("devices.hub.media.process", *self._addresses),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    environment=module_environment(),
                )
            except OSError:
                return False
            self._process = process
            self._orders.clear()
            self._rest.clear()
        self._works = [
            Task("media: to it", lambda _task: self._write(process)).start(),
            Task("media: from it", lambda _task: self._read(process)).start(),
        ]
        return True

    def send(self, data: bytes, *, is_order: bool = False) -> None:
        """Let a frame go to the process, if there is one; returns at once.

        Args:
            data: the frame.
            is_order: whether it may not be left out, as a moment of voice may.
        """
        with self._lock:
            if self._process is not None:
                (self._orders if is_order else self._rest).append(data)
                self._lock.notify()

    def close(self) -> None:
        """End the process for good; harmless where there is none."""
        with self._lock:
            self._is_over = True
            process = self._process
            self._lock.notify()
        if process is not None:
            process.end()
        for work in self._works:
            work.join(END_S)

    def _write(self, process: ChildProcess) -> None:
        while True:
            with self._lock:
                while not (self._orders or self._rest or self._is_gone(process)):
                    self._lock.wait()
                if self._is_gone(process):
                    break
                data = (self._orders or self._rest).popleft()
            try:
                process.stdin.write(data)
                process.stdin.flush()
            except (OSError, ValueError):
                break
        with suppress(OSError, ValueError):
            process.stdin.close()

    def _read(self, process: ChildProcess) -> None:
        try:
            for kind, data in frames.read_frames(process.stdout):
                self._took(kind, data)
        except (OSError, ValueError):
            pass  # it is ended below, and begun again when somebody asks
        process.end()
        with self._lock:
            self._process = None
            self._lock.notify()
            is_over = self._is_over
        process.stdout.close()
        if not is_over:
            self._died()

    def _is_gone(self, process: ChildProcess) -> bool:
        return self._is_over or self._process is not process
