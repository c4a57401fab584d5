"""Handing over a session: made on a thread, and said where it lies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from devices.streams import Slot
from scenes.workers.task import Task
from studio.app.model.log import Level
from studio.app.model.runs.session_folders import let_go
from studio.app.model.workbench import Topic, Workbench
from studio.console.progress import Progress

if TYPE_CHECKING:
    from studio.handover.share import Shared


SHOW, OPEN = "share.show", "share.open"
"""Actions: the folder in the file manager, the file that is opened or sent first."""


class HandingOver:
    """One hand-over at a time; `poll` is called by the window's timer.

    Args:
        bench: where it is said how it went.
    """

    def __init__(self, bench: Workbench) -> None:
        self.shared: Shared | None = None
        """The folder that was made last."""
        self._bench = bench
        self._job: ShareJob | None = None

    @property
    def is_running(self) -> bool:
        """Whether one is being made."""
        return self._job is not None

    def begin(self, rehearsal: Path, out: Path, parts: Sequence[str] | None = None) -> None:
        """Make film, viewer, sheet and archive of a rehearsal's folder.

        Args:
            rehearsal: the folder.
            out: the folder to make.
            parts: names of what is made; None for all.

        Raises:
            ValueError: one is being made, or it is nothing that can be made.
        """
        if self._job is not None:
            raise ValueError("a hand-over is being made already")
        self._job = ShareJob(rehearsal, out, parts)
        self._bench.announce(Topic.SESSION)

    def poll(self) -> str | None:
        """Take what the thread has left; how far it is, in words, if that is new."""
        job = self._job
        if job is None:
            return None
        line = job.lines.take()
        if job.is_running:
            return line
        self._job = None
        if job.shared is None:
            let_go(job.out)
            words = str(job.failure)
            self._bench.say("error", words)
            self._bench.notify(words)
        else:
            self.shared = job.shared
            self._say(job.shared)
        self._bench.announce(Topic.SESSION)
        return line

    def _say(self, shared: Shared) -> None:
        bench, first = self._bench, shared.first
        size = f"{first.name} ({first.stat().st_size / 1e6:.1f} MB)"
        use = "opens in any browser, without a network" if first == shared.viewer else "is ready"
        words = f"Shared in {shared.folder}: {size} {use}; send it or open it"
        level: Level = "warning" if shared.note else "info"
        words += f". Note: {shared.note}" * bool(shared.note)
        bench.say(level, words)
        ways = {
            "Open folder": lambda: bench.do(SHOW),
            f"Open {first.name}": lambda: bench.do(OPEN),
        }
        bench.notify(words, level, ways)

    def close(self) -> None:
        """Cancel and wait."""
        if self._job is not None:
            self._job.close()


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
