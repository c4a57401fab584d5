"""Actions of files: scenes, projects, recent ones, what was dropped."""

from __future__ import annotations

from collections.abc import Callable
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


def add_file_actions(
    bench: Workbench, replacing: Replacing, ask: Ask, ask_folder: AskFolder
) -> None:
    """Add what the File menu holds."""

    def open_any(path: str = "") -> None:
        chosen = path or ask("Open", OPENED, False)
        if not chosen:
            return
        if chosen in SAMPLE_NAMES:
            open_scene(chosen)
            return
        try:
            dropped = what_is(Path(chosen))
            if dropped.action_id != "file.open":
                bench.perform(dropped.action_id, **{dropped.argument: chosen})
                return
            document = load_document(Path(chosen))
        except (ValueError, OSError) as error:
            bench.notify(str(error))
            raise
        replacing.open(document, Path(chosen), recent=chosen)

    def open_folder(path: str = "") -> None:
        chosen = path or ask_folder("Open a room package, a recorded session or photos")
        if chosen:
            open_any(chosen)

    def open_scene(scene: str) -> None:
        replacing.open(with_scene(bench.document, scene), recent=scene)

    def save(path: str = "") -> None:
        known = path or (str(bench.project) if bench.project else "")
        chosen = known or ask("Save project", f"Project (*{SUFFIX})", True)
        if not chosen:
            return
        target = Path(chosen if chosen.endswith(SUFFIX) else chosen + SUFFIX)
        try:
            save_document(bench.document, target)
        except OSError as error:
            raise OSError(
                f"{target}: the project cannot be saved: {error.strerror or error}; free some disk "
                "space, or save it elsewhere (Ctrl+Shift+S). What was saved before is as it was, "
                "and what you have done stays open"
            ) from error
        bench.saved(target)
        bench.remember(str(target))
        bench.say("info", f"saved {target}")

    def save_as() -> None:
        chosen = ask("Save project as", f"Project (*{SUFFIX})", True)
        if chosen:
            save(chosen)

    def new() -> None:
        replacing.open_in_room(Document(bench.document.scene))

    def drop(path: str) -> None:
        try:
            found = what_is(Path(path))
        except ValueError as error:
            bench.notify(str(error))
            raise
        bench.say("info", f"opening {found.what}: {path}")
        bench.perform(found.action_id, **{found.argument: path})

    def drop_all(paths: list[str]) -> None:
        for path in paths:
            drop(path)

    for action in (
        Action("file.new", "New project", "File", new, "in the same room", "Ctrl+N"),
        Action(
            "file.open",
            "Open …",
            "File",
            open_any,
            "a project, scene package, splat file, recording, scenario, video or photos",
            "Ctrl+O",
            ("path",),
            icon="mdi6.folder-open-outline",
        ),
        Action(
            "file.open_folder",
            "Open folder …",
            "File",
            open_folder,
            "a room package (.gnx), a recorded session or photos",
            "Ctrl+Shift+O",
            ("path",),
        ),
        Action(
            "file.open_recent",
            "Open recent",
            "File",
            open_any,
            "scenes, projects, sessions and scenarios that were opened lately",
            arguments=("path",),
            available=lambda: bool(recent_choices(bench.settings)),
            choices=lambda: recent_choices(bench.settings),
        ),
        Action(
            "file.open_scene",
            "Open scene",
            "File",
            open_scene,
            "a built-in room, scene package or splat file, as a new project",
            arguments=("scene",),
            command=lambda scene: f"nexus studio {scene}",
        ),
        Action(
            "file.save",
            "Save project",
            "File",
            save,
            "the scene's name, the scenario and what was changed by hand, in one file",
            "Ctrl+S",
            ("path",),
            icon="mdi6.content-save-outline",
        ),
        Action("file.save_as", "Save project as …", "File", save_as, "", "Ctrl+Shift+S"),
        SplatExport(bench, ask).action(),
        Action(
            "file.drop",
            "Open what was dropped",
            "File",
            drop_all,
            "files and folders that were dragged onto the window",
            arguments=("paths",),
        ),
    ):
        bench.actions.add(action)
    for name in SAMPLE_NAMES:
        bench.actions.add(
            Action(
                f"file.room_{name}",
                f"Open the room {name}",
                "File",
                lambda name=name: open_scene(name),
                "a built-in room",
                command=lambda name=name: f"nexus studio {name}",
            )
        )
