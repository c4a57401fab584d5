"""A thread that makes what is handed over after a rehearsal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from devices.streams import Slot
from scenes.workers.task import Task
from studio.console.progress import Progress

if TYPE_CHECKING:
    from studio.handover.share import Shared


class ShareJob:
    """Film, viewer, sheet and archive of a rehearsal's folder.

    Args:
        rehearsal: the folder.
        out: where the results go.
        parts: names of what is made; None for all.
    """

    def __init__(self, rehearsal: Path, out: Path, parts: Sequence[str] | None = None) -> None:
        self.lines: Slot[str] = Slot()
        self.shared: Shared | None = None
        self.failure: Exception | None = None
        self._rehearsal, self.out, self._parts = rehearsal, out, parts
        self._task = Task("share", self._run)
        self._task.start()

    @property
    def is_running(self) -> bool:
        """Whether it is still at work."""
        return self._task.is_running

    def close(self) -> None:
        """Cancel and wait."""
        self._task.cancel()
        self._task.join()

    def _run(self, task: Task[None]) -> None:
        from studio.handover.share import ALL, Part, share

        progress = Progress(lambda text, _final: self.lines.put(text))
        try:
            parts = ALL if self._parts is None else frozenset(map(Part, self._parts))
            self.shared = share(
                self._rehearsal,
                self.out,
                progress=progress,
                cancelled=task.cancelled,
                parts=parts,
            )
        except Exception as error:  # noqa: BLE001 - shown in the window's log
            self.failure = error
