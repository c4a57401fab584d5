"""Another document in place of the open one: edits are saved first, then its room is loaded."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from studio.app.model.documents.document import Document
from studio.app.model.standing import StandingError
from studio.app.model.workbench import Workbench

if TYPE_CHECKING:
    from scenes.package import ScenePackage
    from studio.app.model.runs.session_run import SessionRun


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


class Replacing:
    """Opens documents. Until a room is read, the one before stays with its view, edits and undo.

    Args:
        bench: whose document is replaced.
        run: reads the rooms.
        leaving: asks about unsaved edits.
    """

    def __init__(self, bench: Workbench, run: SessionRun, leaving: Leaving) -> None:
        self._bench, self._run, self._leaving = bench, run, leaving

    def open(
        self,
        document: Document,
        project: Path | None = None,
        *,
        recent: str = "",
        is_saved: bool = True,
        opened: Callable[[], None] | None = None,
    ) -> None:
        """Ask about unsaved edits, read the document's room, and only then show both.

        Args:
            document: to open.
            project: its file, or None.
            recent: what is remembered as opened; "" for nothing.
            is_saved: see `Workbench.open_document`.
            opened: called once it is shown.
        """

        def swap(scene: ScenePackage) -> None:
            bench = self._bench
            if not self._swap(document, project, is_saved=is_saved):
                return
            bench.show_scene(scene)
            if recent:
                bench.remember(recent)
            if opened is not None:
                opened()

        # Edits that are made while the room is read are asked about, too.
        self._leaving.then(
            lambda: self._run.open_scene(
                document.scene, lambda scene: self._leaving.then(partial(swap, scene))
            )
        )

    def open_in_room(self, document: Document) -> None:
        """Begin with another document in the room that is open."""
        self._leaving.then(lambda: self._swap(document, None, is_saved=True))

    def _swap(self, document: Document, project: Path | None, *, is_saved: bool) -> bool:
        """Show the document, unless a session has begun: then it says so and all stays."""
        try:
            self._bench.open_document(document, project, is_saved=is_saved)
        except StandingError as error:
            self._bench.say("warning", str(error))
            self._bench.notify(str(error), "warning")
            return False
        return True
