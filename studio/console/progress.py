"""Progress of long work, with the time that is left: on a terminal, in a log, in a window."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

LINE_EVERY_S = 5.0
"""Between two lines where the output is a file."""

REDRAW_EVERY_S = 0.2

Show = Callable[[str, bool], None]
"""Takes a line, and whether it is the last one of its task."""


class Progress:
    """Says how far one task at a time has come.

    Args:
        show: shows a line.
        every_s: shortest time between two lines of a task.
    """

    def __init__(self, show: Show, *, every_s: float = REDRAW_EVERY_S) -> None:
        self._show = show
        self._every_s = every_s
        self._task = ""
        self._started = 0.0
        self._shown = 0.0

    def begin(self, task: str) -> None:
        """A new task, such as "drawing the film"."""
        self._task = task
        self._started = self._shown = time.monotonic()
        self._show(f"{task} …", False)

    def advance(self, fraction: float, detail: str = "") -> None:
        """The task is done by `fraction`, 0..1; `detail` is shown beside it."""
        now = time.monotonic()
        if now - self._shown < self._every_s:
            return
        self._shown = now
        spent = now - self._started
        left = f", {_span(spent / fraction - spent)} left" if fraction > 0.02 else ""
        share = f" {min(fraction, 1.0):4.0%}" if fraction > 0 else ""
        self._show(f"{self._task}{share}{left}{'  ' + detail if detail else ''}", False)

    def finish(self, detail: str = "") -> None:
        """The task is done."""
        spent = _span(time.monotonic() - self._started)
        self._show(f"{self._task}: {spent}{', ' + detail if detail else ''}", True)


class StageProgress:
    """Shows work in named stages; its notes are "stage: what is going on".

    Args:
        progress: gets every stage as a task of its own.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._stage = ""

    def __call__(self, done: float, note: str) -> None:
        """How far the stage is that the note begins with."""
        stage, _, detail = note.partition(": ")
        if stage != self._stage:
            self.finish()
            self._progress.begin(stage)
            self._stage = stage
        self._progress.advance(done, detail)

    def finish(self) -> None:
        """The last stage is done."""
        if self._stage:
            self._progress.finish()
        self._stage = ""


def text_progress(stream: TextIO | None = None) -> Progress:
    """Progress on stderr: one line that is redrawn on a terminal, now and then a line in a file."""
    out = stream or sys.stderr
    on_terminal = out.isatty()

    def show(text: str, final: bool) -> None:
        start = "\r\x1b[2K" if on_terminal else ""
        end = "" if on_terminal and not final else "\n"
        print(f"{start}{text}", end=end, file=out, flush=True)

    return Progress(show, every_s=REDRAW_EVERY_S if on_terminal else LINE_EVERY_S)


def _span(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s"
