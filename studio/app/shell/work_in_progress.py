"""Unsaved work, kept from moment to moment and offered again after a crash."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from studio.app.model.documents.autosave import Autosave, Recovered, discard, recoverable
from studio.app.model.runs.leaving import Replacing
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.notice import NoticeBar


class WorkInProgress:
    """Keeps the bench's document on the disk while it is not saved, each document by itself.

    Args:
        bench: whose document.
        home: folder of work in progress.
        notice: where what was left behind is offered.
        replacing: opens what the user restores.
    """

    def __init__(
        self, bench: Workbench, home: Path, notice: NoticeBar, replacing: Replacing
    ) -> None:
        self._bench, self._home, self._notice = bench, home, notice
        self._replacing = replacing
        self._number = 0
        self._autosave = Autosave(home)
        self._has_kept = False
        bench.listen(Topic.OPENED, self._begin_anew)
        bench.listen(Topic.DOCUMENT, self._keep)

    def poll(self) -> None:
        """Say why work could not be kept, if it could not."""
        problem = self._autosave.problem()
        if problem is not None:
            self._bench.say("error", problem)

    def offer(self) -> None:
        """Offer what crashed studios have left, one after the other."""
        self._offer(recoverable(self._home))

    def close(self) -> None:
        """End; work that is neither saved nor given up stays kept."""
        bench = self._bench
        self._autosave.stop(keep=not (bench.is_saved or bench.is_given_up))

    def _keep(self) -> None:
        bench = self._bench
        if not bench.is_saved:
            self._autosave.keep(bench.document, bench.project)
            self._has_kept = True
        elif self._has_kept:
            self._autosave.forget()
            self._has_kept = False

    def _begin_anew(self) -> None:
        """Another document is open: its work goes to a file of its own."""
        self._autosave.stop(keep=self._bench.left_unsaved)
        self._number += 1
        self._autosave = Autosave(self._home, number=self._number)
        self._has_kept = False

    def _offer(self, found: list[Recovered]) -> None:
        if not found:
            return
        first, *others = found
        name = first.project.stem if first.project else Path(first.document.scene).name
        self._notice.offer(
            f"Unsaved work on {name!r} was left behind when the studio ended.",
            {
                "Restore": partial(self._recover, first, others),
                "Discard": partial(self._discard, first, others),
            },
        )

    def _recover(self, found: Recovered, others: list[Recovered]) -> None:
        def opened() -> None:
            # As soon as its own file is written, what was left behind is no longer needed.
            found.path.replace(self._autosave.path)
            self._has_kept = True
            self._keep()
            self._bench.say("info", "restored; save it to keep it")
            self._offer(others)

        self._replacing.open(found.document, found.project, is_saved=False, opened=opened)

    def _discard(self, found: Recovered, others: list[Recovered]) -> None:
        discard(found)
        self._offer(others)
