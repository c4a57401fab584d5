"""Splats of what is shown, written to a file of any format that other programs read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QTimer

from scenes.workers.task import Task
from studio.app.model.actions import Action, Choice
from studio.app.model.documents.document import shown_pose
from studio.app.model.workbench import Workbench
from studio.app.shell.questions import Ask

if TYPE_CHECKING:  # what reads and writes splats is not imported before the window is shown
    from scenes.package import ScenePackage
    from scenes.splats import SplatCloud
    from scenes.state import SceneState

ALL, ROOM = "all", "room"
"""Choices of the export beside a single object's id."""

POLL_MS = 100
BUSY = "exporting splats"


def kinds() -> str:
    """Writable formats as a file dialog lists them, PLY first; its choice decides the ending."""
    from scenes.formats.registry import FORMATS

    listed = (f"{f.name} (*{' *'.join(f.suffixes)})" for f in FORMATS if f.write is not None)
    return ";;".join(listed)


def splats_of(scene: ScenePackage, state: SceneState, what: str) -> SplatCloud:
    """The splats that are written.

    Args:
        scene: what is open.
        state: where its objects are shown.
        what: `ALL`, with every object where it is shown; `ROOM` without them; or an object's id,
            which is written alone, in its own frame.

    Raises:
        ValueError: there is no such object.
    """
    from scenes.harmonics import turned
    from scenes.splats import concatenate

    if what == ROOM:
        return scene.room
    if what != ALL:
        found = [item.splats for item in scene.objects if item.object_id == what]
        if not found:
            known = ", ".join([ALL, ROOM, *(item.object_id for item in scene.objects)])
            raise ValueError(f"export of {what!r}: no such object, wanted one of {known}")
        return found[0]
    placed = [
        turned(item.splats, shown_pose(state, item.object_id, item.world_from_object))
        for item in scene.objects
    ]
    return concatenate([scene.room, *placed])


class SplatExport:
    """Writes on a thread; a window that closes meanwhile leaves a whole file all the same.

    Args:
        bench: whose scene is written.
        ask: for the file, before it is replaced, too.
    """

    def __init__(self, bench: Workbench, ask: Ask) -> None:
        self._bench, self._ask = bench, ask
        self._task: Task[None] | None = None
        self._said = ""
        self._timer = QTimer()
        self._timer.setInterval(POLL_MS)
        self._timer.timeout.connect(self._poll)

    def action(self) -> Action:
        """Actions of the File menu."""
        return Action(
            "file.export_splats",
            "Export splats",
            "File",
            self.export,
            "the room as it is shown, or an object, for other programs: PLY, SPZ, glTF, USD …",
            arguments=("what", "path"),
            available=lambda: self._bench.scene is not None and self._task is None,
            choices=self._choices,
        )

    def export(self, what: str = ALL, path: str = "") -> None:
        """Begin to write; without a path, ask for one.

        Raises:
            ValueError: there is nothing of that name, or no format of that ending.
        """
        from scenes.formats.registry import require_world_writer

        scene = self._bench.scene
        if scene is None:
            raise ValueError("there are no splats to export yet: open a room first")
        cloud = splats_of(scene, self._bench.state, what)
        chosen = path or self._ask("Export splats", kinds(), True)
        if not chosen:
            return
        target = Path(chosen)
        try:
            require_world_writer(target)
        except ValueError as error:
            self._bench.notify(str(error))
            raise
        self._task = Task(
            BUSY,
            lambda _: self._write(target, cloud),
            expected=(ValueError, OSError),
            is_awaited=True,
        )
        self._said = f"exported {len(cloud):,} splats to {target}"
        self._bench.busy.add(BUSY)
        self._bench.say("info", f"exporting {len(cloud):,} splats to {target} …")
        self._task.start()
        self._timer.start()

    def _choices(self) -> Sequence[Choice]:
        bench, scene = self._bench, self._bench.scene
        if scene is None:
            return ()
        objects = {item.object_id: bench.name_of(item.object_id) for item in scene.objects}
        found = [Choice("All, as it is shown …", {"what": ALL})]
        if objects:
            found.append(Choice("The room without its objects …", {"what": ROOM}))
        if bench.selection in objects:
            name = objects[bench.selection]
            found.append(Choice(f"What is selected: {name} …", {"what": bench.selection}))
        return [*found, *(Choice(f"{name} …", {"what": key}) for key, name in objects.items())]

    def _write(self, target: Path, cloud: SplatCloud) -> None:
        from scenes.formats.registry import require_world_writer
        from scenes.formats.storage.blocks import in_blocks

        require_world_writer(target)[1](target, in_blocks(cloud))

    def _poll(self) -> None:
        if self._task is None or self._task.is_running:
            return
        self._timer.stop()
        failure, self._task = self._task.problem, None
        self._bench.busy.discard(BUSY)
        if failure:
            self._bench.say("error", failure)
            self._bench.notify(failure)
        else:
            self._bench.say("info", self._said)
