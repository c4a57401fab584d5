"""The turns of a room or a site: looks at what is new on a thread, one after the other."""

from __future__ import annotations

from collections.abc import Callable

from scenes.workers.task import Task

TICK_S = 1.0 / 90.0
"""Time between two looks at what is new, chosen: a headset's picture."""

END_S = 2.0
"""Longest wait for the thread at the end, seconds."""

MAX_DEFECTS = 32
"""Different defects that are said, chosen: of more, the first ones tell."""


class Turns:
    """Looks that go on until they are ended; people stay connected through a defect of one.

    Args:
        name: of the thread; lines of the log begin with it.
        turn: looks once.
        say: takes a line for the log; each defect is said once.
    """

    def __init__(self, name: str, turn: Callable[[], None], *, say: Callable[[str], None]) -> None:
        self._name, self._turn, self._say = name, turn, say
        self._defects: set[str] = set()
        self._task = Task(name, self._run)

    def start(self) -> None:
        """Begin to look."""
        self._task.start()

    def end(self) -> None:
        """Look no more; waits for the look that is being taken."""
        self._task.cancel()
        self._task.join(END_S)

    def _run(self, task: Task[None]) -> None:
        while not task.pause(TICK_S):
            try:
                self._turn()
            except Exception as error:  # noqa: BLE001 - a defect, said once; the session goes on
                said = f"{type(error).__name__}: {error}"
                if said not in self._defects and len(self._defects) < MAX_DEFECTS:
                    self._defects.add(said)
                    self._say(f"{self._name}: {said}")
