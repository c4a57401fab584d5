"""Computes the searches of a live session in a process of its own."""

from __future__ import annotations

import logging
import queue
import subprocess
import threading
from collections.abc import Sequence
from contextlib import suppress
from io import BufferedIOBase
from typing import TypeVar, cast

from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.task import Task
from tracking.beside.messages import (
    Answer,
    Part,
    decoded,
    encoded,
    read_message,
    write_message,
)
from tracking.hypotheses.search_runner import Progress, SearchInFrames, Work

T = TypeVar("T")

log = logging.getLogger(__name__)

MAX_DEATHS = 3
"""Deaths of the process after which searches are computed in the frames: it has no memory, or what
it computes kills it."""

LEAVING_S = 2.0
"""Seconds that the process and its threads have to end."""


class SearchProcessError(Exception):
    """A search raised something in the process; says what."""


class _Process:
    """The process, and what it answered.

    Its threads only wait for the pipes, so that a session is never late for a picture of 12 MB.
    """

    def __init__(self, niceness: int) -> None:
        self._process = ChildProcess(
            module_command("tracking.beside.process", str(niceness)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            environment=module_environment(),
        )
        self._numbers: queue.SimpleQueue[int | None] = queue.SimpleQueue()
        self._unwritten: dict[int, Sequence[Part]] = {}
        self._answers: dict[int, Answer] = {}
        self._awaited: set[int] = set()
        self._lock = threading.Lock()
        self.is_dead = False
        self._tasks = [
            Task("search orders", self._write).start(),
            Task("search answers", self._read).start(),
        ]

    def order(self, number: int, parts: Sequence[Part]) -> None:
        """Compute a search once those before it have ended."""
        with self._lock:
            self._awaited.add(number)
            self._unwritten[number] = parts
        self._numbers.put(number)

    def give_up(self, number: int) -> None:
        """Do not compute a search any more."""
        with self._lock:
            self._awaited.discard(number)
            self._answers.pop(number, None)
            self._unwritten.pop(number, None)
        self._numbers.put(number)

    def answer(self, number: int) -> Answer | None:
        """Return the result of a search; None while it is computed."""
        with self._lock:
            return self._answers.pop(number, None)

    def end(self) -> None:
        """End the process and the threads."""
        self._numbers.put(None)
        self._process.kill()
        self._process.wait(LEAVING_S)
        for task in self._tasks:
            task.join(LEAVING_S)

    def _write(self, _task: Task[None]) -> None:
        with suppress(OSError), self._process.stdin as stream:
            while (number := self._numbers.get()) is not None:
                self._write_order(stream, number)

    def _write_order(self, stream: BufferedIOBase, number: int) -> None:
        """Write an order, or that it is given up; its pictures are not held here afterwards."""
        with self._lock:
            parts = self._unwritten.pop(number, ())
        write_message(stream, number, parts)

    def _read(self, _task: Task[None]) -> None:
        with self._process.stdout as stream:
            while self._read_answer(stream):
                pass
        self.is_dead = True

    def _read_answer(self, stream: BufferedIOBase) -> bool:
        """Read the next answer; whether there was one. It is not held here afterwards."""
        message = read_message(stream)
        if message is None:
            return False
        number, parts = message
        answer = cast(Answer, decoded(parts))
        with self._lock:
            if number in self._awaited:
                self._awaited.discard(number)
                self._answers[number] = answer
        return True


class SearchBesideFrames:
    """Computes searches in another process; a frame only begins one, or takes its result.

    It is started by `start` or the first search, and again if it dies.

    Args:
        niceness: how much less urgent than the session the process is.
    """

    def __init__(self, niceness: int = 0) -> None:
        self._niceness = niceness
        self._in_frames = SearchInFrames()
        self._deaths = 0
        self._number = self._first = 1
        self._has_ended = False
        self._process: _Process | None = None

    def start(self) -> None:
        """Start the process, for the first search not to wait for it, unless it dies often."""
        if self._process is None and self._deaths < MAX_DEATHS:
            self._process = _Process(self._niceness)

    def advance(
        self, progress: Progress, work: Work[T], *, budget_ms: float
    ) -> tuple[Progress, T | None]:
        """See `SearchRunner.advance`; the budget counts only after many deaths of the process.

        Raises:
            SearchProcessError: the search failed.
        """
        process = self._started()
        if process is None:
            progress, result = self._in_frames.advance(progress, work, budget_ms=budget_ms)
            self._has_ended |= result is not None
            return progress, result
        number = progress.number
        if number is None or number < self._first:
            number = self._number
            self._number += 1
            process.order(number, encoded(work))
            return Progress(number=number), None
        answer = process.answer(number)
        if answer is None:
            return progress, None
        if answer.failure:
            raise SearchProcessError(answer.failure)
        self._has_ended = True
        return progress, cast(T, answer.result)

    def give_up(self, progress: Progress) -> None:
        """See `SearchRunner.give_up`."""
        number, process = progress.number, self._process
        if number is not None and number >= self._first and process is not None:
            process.give_up(number)

    def _started(self) -> _Process | None:
        """The process; None if it has died too often. One that died before is started again."""
        process = self._process
        if process is not None and process.is_dead and self._deaths < MAX_DEATHS:
            process.end()
            self._deaths += 1
            self._process, self._first = None, self._number
            if self._deaths == MAX_DEATHS:
                log.warning(
                    "the search process died %d times: lost objects are looked for in the frames, "
                    "which takes longer. Is there memory left?",
                    self._deaths,
                )
        self.start()
        return self._process

    def has_ended(self) -> bool:
        """Whether a search has ended since the last call: what `SearchAsRecorded` needs."""
        ended, self._has_ended = self._has_ended, False
        return ended

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.end()
