"""The preparation panel: a room from what is dropped, and objects cut out of it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QTabWidget, QVBoxLayout, QWidget

from studio.app.model.actions import Action
from studio.app.model.workbench import Workbench
from studio.app.preparation.cut_page import CutPage
from studio.app.preparation.room_page import RoomPage
from studio.app.preparation.scale_page import ScalePage


class PreparationDock(QWidget):
    """Three tabs: a room is prepared, objects are cut out, a room that is open gets its scale.

    Args:
        bench: whose scene is cut or scaled, and where a room that is ready is opened.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.room = RoomPage(bench)
        self.cut = CutPage(bench)
        self.scale = ScalePage(bench)
        self.tabs = QTabWidget()
        self.tabs.addTab(self.room, "Room")
        self.tabs.addTab(self.cut, "Objects")
        self.tabs.addTab(self.scale, "Scale")
        self.scale.asked.connect(lambda: self.tabs.setCurrentWidget(self.scale))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.tabs)
        for action in self._actions():
            if action.id not in bench.actions:
                bench.actions.add(action)

    def _actions(self) -> tuple[Action, ...]:
        group = "Preparation"
        return (
            Action(
                "preparation.add",
                "Choose what to prepare",
                group,
                lambda path: self.room.add(Path(path)),
                "a video, a folder of photos, a splat file or a headset's mesh",
                arguments=("path",),
            ),
            Action("preparation.start", "Prepare", group, self.room.begin, "make a room of it"),
            Action(
                "preparation.set_scale",
                "Set the scale by the measured line",
                group,
                self.scale.begin,
                "how long what was measured is really; makes a new scene, the old one stays",
                arguments=("metres",),
            ),
            Action(
                "preparation.room_of",
                "Make a room of the splat file",
                group,
                self.make_room_of,
                "its floor and walls are found; its unit or its ceiling's height is asked for",
                arguments=("path",),
            ),
            Action(
                "preparation.cancel",
                "Cancel the preparation",
                group,
                self.room.cancel,
                available=lambda: self.room.job is not None and self.room.job.is_running,
            ),
            *self._cut_actions(group),
        )

    def _cut_actions(self, group: str) -> tuple[Action, ...]:
        """The actions of the page on which the scene is changed by marks."""
        return (
            Action(
                "preparation.cut",
                "Cut the marked object out",
                group,
                self.cut.begin,
                "on a copy of the scene; can be undone",
            ),
            Action(
                "preparation.clean",
                "Remove the marked splats",
                group,
                self.cut.clean,
                "takes what was marked by box, lasso or brush out of the room; can be undone",
                available=lambda: bool(self.cut.marks),
            ),
            Action(
                "preparation.sharpen",
                "Sharpen what is marked or named",
                group,
                self.cut.sharpen,
                "trains it with the photos' own resolution, on a copy of the scene; can be undone",
            ),
            Action(
                "preparation.undo_cut",
                "Undo the last cut or sharpening",
                group,
                self.cut.undo,
                "puts the scene before it back",
                available=lambda: bool(self.cut.kept),
            ),
        )

    def make_room_of(self, path: str = "") -> None:
        """Show the page on which a splat file becomes a room; without a path, of the open one.

        Raises:
            ValueError: it is not there.
        """
        self.room.add(Path(path or self._bench.document.scene))
        self.tabs.setCurrentWidget(self.room)
        if "dock.preparation" in self._bench.actions:
            self._bench.do("dock.preparation")

    def closeEvent(self, event: QCloseEvent) -> None:
        """End what runs on the pages."""
        for page in (self.room, self.cut, self.scale):
            page.close()
        event.accept()
