"""Actions of files: scenes, projects, recent ones, what was dropped."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from scenes.samples import SAMPLE_NAMES
from studio.app.model.actions import Action
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import SUFFIX, load_document, save_document
from studio.app.model.documents.dropped import what_is
from studio.app.model.documents.recent import recent_choices
from studio.app.model.runs.leaving import Replacing
from studio.app.model.runs.session_run import with_scene
from studio.app.model.workbench import Workbench
from studio.app.shell.actions.export import SplatExport
from studio.app.shell.questions import Ask

OPENED = f"Projects, scenes, recordings, scenarios (*{SUFFIX} *.ply *.spz *.mcap *.toml);;All (*)"
"""Files that *Open …* shows."""

AskFolder = Callable[[str], str]
"""Asks the user for a folder: title; "" if none was chosen."""


class FileActions:
    """Actions of the File menu.

    Args:
        bench: whose document is opened and saved.
        replacing: opens another document in place of the open one.
        ask: asks the user for a file.
        ask_folder: asks the user for a folder.
    """

    def __init__(
        self, bench: Workbench, replacing: Replacing, ask: Ask, ask_folder: AskFolder
    ) -> None:
        self._bench, self._replacing = bench, replacing
        self._ask, self._ask_folder = ask, ask_folder

    def add(self) -> None:
        """Add what the File menu holds."""
        for action in (*self._opening(), *self._saving(), *self._rooms()):
            self._bench.actions.add(action)

    def open_any(self, path: str = "") -> None:
        """Open a project, scene, recording, scenario, video or photos; without a path, ask."""
        chosen = path or self._ask("Open", OPENED, False)
        if not chosen:
            return
        if chosen in SAMPLE_NAMES:
            self.open_scene(chosen)
            return
        try:
            dropped = what_is(Path(chosen))
            if dropped.action_id != "file.open":
                self._bench.perform(dropped.action_id, **{dropped.argument: chosen})
                return
            document = load_document(Path(chosen))
        except (ValueError, OSError) as error:
            self._bench.notify(str(error))
            raise
        self._replacing.open(document, Path(chosen), recent=chosen)

    def open_folder(self, path: str = "") -> None:
        """Open a room package, a recorded session or photos; without a path, ask."""
        chosen = path or self._ask_folder("Open a room package, a recorded session or photos")
        if chosen:
            self.open_any(chosen)

    def open_scene(self, scene: str) -> None:
        """Open a built-in room, scene package or splat file as a new project."""
        self._replacing.open(with_scene(self._bench.document, scene), recent=scene)

    def save(self, path: str = "") -> None:
        """Save the project; without a path, where it was saved before.

        Raises:
            OSError: it cannot be written; what was saved before is as it was.
        """
        known = path or (str(self._bench.project) if self._bench.project else "")
        chosen = known or self._ask("Save project", f"Project (*{SUFFIX})", True)
        if not chosen:
            return
        target = Path(chosen if chosen.endswith(SUFFIX) else chosen + SUFFIX)
        try:
            save_document(self._bench.document, target)
        except OSError as error:
            raise OSError(
                f"{target}: the project cannot be saved: {error.strerror or error}; free some disk "
                "space, or save it elsewhere (Ctrl+Shift+S). What was saved before is as it was, "
                "and what you have done stays open"
            ) from error
        self._bench.saved(target)
        self._bench.remember(str(target))
        self._bench.say("info", f"saved {target}")

    def save_as(self) -> None:
        """Save the project in a file that is asked for."""
        chosen = self._ask("Save project as", f"Project (*{SUFFIX})", True)
        if chosen:
            self.save(chosen)

    def new(self) -> None:
        """Begin a project in the same room."""
        self._replacing.open_in_room(Document(self._bench.document.scene))

    def drop(self, path: str) -> None:
        """Open a file or folder that was dropped."""
        try:
            found = what_is(Path(path))
        except ValueError as error:
            self._bench.notify(str(error))
            raise
        self._bench.say("info", f"opening {found.what}: {path}")
        self._bench.perform(found.action_id, **{found.argument: path})

    def drop_all(self, paths: list[str]) -> None:
        """Open files and folders that were dragged onto the window."""
        for path in paths:
            self.drop(path)

    def _opening(self) -> tuple[Action, ...]:
        return (
            Action("file.new", "New project", "File", self.new, "in the same room", "Ctrl+N"),
            Action(
                "file.open",
                "Open …",
                "File",
                self.open_any,
                "a project, scene package, splat file, recording, scenario, video or photos",
                "Ctrl+O",
                ("path",),
                icon="mdi6.folder-open-outline",
            ),
            Action(
                "file.open_folder",
                "Open folder …",
                "File",
                self.open_folder,
                "a room package (.gnx), a recorded session or photos",
                "Ctrl+Shift+O",
                ("path",),
            ),
            Action(
                "file.open_recent",
                "Open recent",
                "File",
                self.open_any,
                "scenes, projects, sessions and scenarios that were opened lately",
                arguments=("path",),
                available=lambda: bool(recent_choices(self._bench.settings)),
                choices=lambda: recent_choices(self._bench.settings),
            ),
            Action(
                "file.open_scene",
                "Open scene",
                "File",
                self.open_scene,
                "a built-in room, scene package or splat file, as a new project",
                arguments=("scene",),
                command=lambda scene: f"nexus studio {scene}",
            ),
        )

    def _saving(self) -> tuple[Action, ...]:
        return (
            Action(
                "file.save",
                "Save project",
                "File",
                self.save,
                "the scene's name, the scenario and what was changed by hand, in one file",
                "Ctrl+S",
                ("path",),
                icon="mdi6.content-save-outline",
            ),
            Action("file.save_as", "Save project as …", "File", self.save_as, "", "Ctrl+Shift+S"),
            SplatExport(self._bench, self._ask).action(),
            Action(
                "file.drop",
                "Open what was dropped",
                "File",
                self.drop_all,
                "files and folders that were dragged onto the window",
                arguments=("paths",),
            ),
        )

    def _rooms(self) -> list[Action]:
        return [
            Action(
                f"file.room_{name}",
                f"Open the room {name}",
                "File",
                partial(self.open_scene, name),
                "a built-in room",
                command=lambda name=name: f"nexus studio {name}",
            )
            for name in SAMPLE_NAMES
        ]
