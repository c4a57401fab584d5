"""Another document in place of the one that is open: its room is loaded first, then both change."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from studio.app.model.documents.document import Document
from studio.app.model.runs.leaving import Leaving
from studio.app.model.standing import StandingError
from studio.app.model.workbench import Workbench

if TYPE_CHECKING:
    from scenes.package import ScenePackage


class LoadsScenes(Protocol):
    """Reads scenes; `SessionRun` is the one there is."""

    def open_scene(self, scene: str, then: Callable[[ScenePackage], None] | None = None) -> None:
        """Read a scene on a thread; what plays is stopped first."""
        ...


class Replacing:
    """Opens documents. Until a room is read, the one before stays with its view, edits and undo.

    Args:
        bench: whose document is replaced.
        run: reads the rooms.
        leaving: asks about unsaved edits.
    """

    def __init__(self, bench: Workbench, run: LoadsScenes, leaving: Leaving) -> None:
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
