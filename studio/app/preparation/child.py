"""A verb in a process of its own: what it prints is read line by line, and it can be ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Sequence

LINES = 400
"""Lines that are kept of what the process says on stderr."""
GRACE_S = 5.0
"""Seconds that a process has to end by itself once it was asked to."""


class Child:
    """`python -m studio.cli WORDS …`; started at once, any thread may ask.

    Args:
        words: the verb and its flags.
    """

    def __init__(self, words: Sequence[str]) -> None:
        self.is_cancelled = False
        self._said: deque[str] = deque(maxlen=LINES)
        self._out: list[str] = []
        self._process = subprocess.Popen(
            [sys.executable, "-m", "studio.cli", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=os.name == "posix",
        )
        self._readers = [
            threading.Thread(target=self._read_out, name=f"{words[0]} figures", daemon=True),
            threading.Thread(target=self._read_said, name=f"{words[0]} progress", daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    @property
    def is_running(self) -> bool:
        """Whether it is at work, or not all that it said has been read."""
        return self._process.poll() is None or any(reader.is_alive() for reader in self._readers)

    @property
    def code(self) -> int | None:
        """Its exit status, or None while it runs."""
        return self._process.poll()

    def said(self) -> list[str]:
        """Return its lines on stderr so far."""
        return list(self._said)

    def printed(self) -> str:
        """Its standard output."""
        return "".join(self._out)

    def cancel(self) -> None:
        """Ask it to end, and end it if it does not; returns at once."""
        if self._process.poll() is None:
            self.is_cancelled = True
            self._signal(signal.SIGTERM)
            threading.Thread(target=self._end, name="ending a process", daemon=True).start()

    def wait(self, limit_s: float) -> bool:
        """Whether it has ended within a time: for closing windows and tests."""
        try:
            self._process.wait(limit_s)
        except subprocess.TimeoutExpired:
            return False
        for reader in self._readers:
            reader.join(limit_s)
        return True

    def _end(self) -> None:
        if not self.wait(GRACE_S):
            self._process.kill()

    def _signal(self, number: int) -> None:
        if os.name == "posix":
            # Trainers are processes of its own: they end with it.
            os.killpg(self._process.pid, number)
        else:
            self._process.terminate()

    def _read_out(self) -> None:
        assert self._process.stdout is not None
        self._out.extend(self._process.stdout)

    def _read_said(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            # The window says who speaks; a terminal needs the name.
            self._said.append(line.rstrip().removeprefix("nexus: "))
