"""A document goes only after its unsaved edits are saved, or the user has given them up."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

from studio.app.model.workbench import Workbench


class Answer(StrEnum):
    """A user's wish for unsaved edits."""

    SAVE = "save"
    DISCARD = "discard"
    CANCEL = "cancel"
    KEEP = "keep"
    """Nobody is there to ask: they stay kept as work in progress, and are offered again."""


AskUnsaved = Callable[[str, Callable[[Answer], None]], None]
"""Asks what becomes of the edits of a document of that name; calls back with the answer."""


class Leaving:
    """Asks before a document goes.

    Args:
        bench: whose document.
        ask: asks the user.
        save: the document to its file, asking for one where there is none.
    """

    def __init__(self, bench: Workbench, ask: AskUnsaved, save: Callable[[], object]) -> None:
        self._bench, self._ask, self._save = bench, ask, save

    def then(self, go_on: Callable[[], object]) -> None:
        """Go on, at once or after the answer; not at all if the user cancels or saving fails."""
        bench = self._bench
        if bench.is_saved or bench.is_given_up:
            go_on()
            return

        def answered(answer: Answer) -> None:
            if answer is Answer.SAVE:
                self._save()
                if not bench.is_saved:
                    return  # no file was chosen, or it cannot be written, which has been said
            elif answer is Answer.DISCARD:
                bench.give_up()
            if answer is not Answer.CANCEL:
                go_on()

        self._ask(document_name(bench), answered)


def document_name(bench: Workbench) -> str:
    """How the document is called for people: as its project, or as its room."""
    return bench.project.stem if bench.project else Path(bench.document.scene).name
