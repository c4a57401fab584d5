"""A verb in a process of its own: what it prints is read line by line, and it can be ended."""

from __future__ import annotations

from collections.abc import Sequence

from scenes.workers.child_process import ChildProcess, module_command
from scenes.workers.task import Task

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
        self._out: list[str] = []
        # Trainers are processes of its own: they end with it.
        self._process = ChildProcess(
            module_command("studio.cli", *words),
            on_line=self._out.append,
            last_words=LINES,
            has_group=True,
        )

    @property
    def is_running(self) -> bool:
        """Whether it is at work, or not all that it said has been read."""
        return self._process.is_running

    @property
    def code(self) -> int | None:
        """Its exit status, or None while it runs."""
        return self._process.code

    def said(self) -> list[str]:
        """Return its lines on stderr so far."""
        # The window says who speaks; a terminal needs the name.
        return [line.rstrip().removeprefix("nexus: ") for line in self._process.last_words()]

    def printed(self) -> str:
        """Return its standard output."""
        return "\n".join(self._out)

    def cancel(self) -> None:
        """Ask it to end, and end it if it does not; returns at once."""
        if self._process.code is None:
            self.is_cancelled = True
            self._process.cancel()
            Task("ending a process", self._end).start()

    def wait(self, limit_s: float) -> bool:
        """Whether it has ended within a time: for closing windows and tests."""
        return self._process.join(limit_s)

    def _end(self, _task: Task[None]) -> None:
        if not self.wait(GRACE_S):
            self._process.kill()
