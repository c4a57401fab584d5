"""Progress of long work on stderr, with the time that is left."""

from __future__ import annotations

import sys
import time
from typing import TextIO

LINE_EVERY_S = 5.0
"""Between two lines where the output is a file."""

REDRAW_EVERY_S = 0.2


class Progress:
    """Shows how far one task at a time has come; says nothing when `quiet`.

    Args:
        stream: where to; stderr by default.
        quiet: show nothing.
    """

    def __init__(self, stream: TextIO | None = None, *, quiet: bool = False) -> None:
        self._stream = stream or sys.stderr
        self._quiet = quiet
        self._on_terminal = self._stream.isatty()
        self._task = ""
        self._started = 0.0
        self._shown = 0.0

    def begin(self, task: str) -> None:
        """A new task, such as "drawing the film"."""
        self._task = task
        self._started = self._shown = time.monotonic()
        self._show(f"{task} …", end="\r" if self._on_terminal else "\n")

    def advance(self, fraction: float, detail: str = "") -> None:
        """The task is done by `fraction`, 0..1; `detail` is shown beside it."""
        now = time.monotonic()
        if now - self._shown < (REDRAW_EVERY_S if self._on_terminal else LINE_EVERY_S):
            return
        self._shown = now
        spent = now - self._started
        left = f", {_span(spent / fraction - spent)} left" if fraction > 0.02 else ""
        text = f"{self._task} {min(fraction, 1.0):4.0%}{left}{'  ' + detail if detail else ''}"
        self._show(text, end="\r" if self._on_terminal else "\n")

    def finish(self, detail: str = "") -> None:
        """The task is done."""
        spent = _span(time.monotonic() - self._started)
        self._show(f"{self._task}: {spent}{', ' + detail if detail else ''}", end="\n")

    def _show(self, text: str, *, end: str) -> None:
        if not self._quiet:
            clear = "\x1b[2K" if self._on_terminal else ""
            print(f"{clear}{text}", end=end, file=self._stream, flush=True)


def _span(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s"
