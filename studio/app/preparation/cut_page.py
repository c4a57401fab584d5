"""The page on which objects are cut out of the scene that is open."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QCloseEvent, QHideEvent, QImage
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSlider,
    QVBoxLayout,
    QWidget,
)

from devices.streams import Slot
from scenes.workers.task import Task
from studio.app.model.workbench import Topic, Workbench
from studio.app.preparation.cut_job import Change, CutJob, Mark, undo
from studio.app.preparation.photo_marker import BeforeAfter, MarkTool, PhotoMarker
from studio.app.shell.theme import SHAPES
from studio.app.shell.wrapping import WrappingRow
from studio.app.viewport.view_grid import ViewGrid

Pictures = dict[str, NDArray[np.uint8]]


class ViewPictures:
    """Draws some views of a scene package; `result` has the pictures by view, or why not.

    Args:
        scene: folder of the package.
        names: of the views to draw; empty for `most` of all, spread evenly.
        most: views drawn.
    """

    def __init__(self, scene: Path, names: tuple[str, ...] = (), *, most: int = 8) -> None:
        self.result: Slot[Pictures | str] = Slot()
        self._scene, self._names, self._most = scene, names, most
        Task("drawing views", self._draw).start()

    def _draw(self, _task: Task[None]) -> None:
        from scenes.package import load_package
        from scenes.pose import Pose
        from scenes.render.native import NativeRenderer
        from scenes.render.renderer import PosedSplats

        try:
            package = load_package(self._scene)
            views = [view for view in package.views if view.name in self._names]
            if not self._names and package.views:
                count = min(self._most, len(package.views))
                places = np.linspace(0, len(package.views) - 1, count).round().astype(int)
                views = [package.views[place] for place in dict.fromkeys(places.tolist())]
            renderer, room = NativeRenderer(), [PosedSplats(package.room, Pose.identity())]
            pictures: Pictures = {}
            for view in views:
                drawn = renderer.render(room, view.camera, view.world_from_camera)
                pictures[view.name] = (np.clip(drawn.rgb, 0, 1) * 255 + 0.5).astype(np.uint8)
            self.result.put(pictures or f"{self._scene.name} has no views to mark objects in")
        except (ValueError, OSError) as error:
            self.result.put(str(error))


POLL_MS = 200

CLEAN_TIP = (
    "take what is marked out of the room: in one view what hangs before it, in several what lies "
    "in all marks"
)
"""Words of the button that removes splats."""

SHARPEN_TIP = (
    "train with the photos' own resolution: around a mark, else the object that is named, else all "
    "objects; half a minute each"
)
"""Words of the button that sharpens."""

BEGUN = {
    Change.CUT: "cutting on a copy …",
    Change.CLEAN: "cleaning a copy …",
    Change.SHARPEN: "sharpening a copy …",
}
"""Lines that say what has begun."""


class CutPage(QWidget):
    """A view to mark in, a name, before and after, undo.

    Args:
        bench: whose scene is cut.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.job: CutJob | None = None
        self.kept: list[tuple[Path, Path]] = []
        """Scenes that were cut, each with where it is kept as it was; the last is undone first."""
        self.marks: dict[str, Mark] = {}
        self._pictures: Pictures = {}
        self._drawing: ViewPictures | None = None
        self._after: ViewPictures | None = None
        self.views, self.tool = QComboBox(), QComboBox()
        self.views.setAccessibleName("View")
        self.tool.addItems(list(MarkTool))
        self.tool.setAccessibleName("Mark by")
        self.clear_button = QPushButton("Clear")
        self.clear_button.setToolTip("take the marks of this view away")
        self.clear_button.clicked.connect(self._clear)
        self.load_button = QPushButton("Show views")
        self.load_button.clicked.connect(self.load)
        self.marker, self.compare = PhotoMarker(), BeforeAfter()
        self.marker.hint = "Show views, then draw a box around the whole object in 1 to 3 of them"
        self.large = QPushButton("Large")
        self.large.setCheckable(True)
        self.large.setEnabled(False)
        self.large.setToolTip("the view to mark in takes the place of the room's")
        self.large.toggled.connect(self._enlarge)
        self.name = QLineEdit()
        self.name.setPlaceholderText("Name of the object")
        self.cut_button = self._button("Cut out", "preparation.cut")
        self.clean_button = self._button("Remove splats", "preparation.clean", tip=CLEAN_TIP)
        self.sharpen_button = self._button("Sharpen", "preparation.sharpen", tip=SHARPEN_TIP)
        self.undo_button = self._button("Undo", "preparation.undo_cut")
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, 100)
        self.slider.setValue(50)
        self.slider.setAccessibleName("Before and after")
        self.line = QLabel()
        self.line.setWordWrap(True)
        self._lay_out()
        self.views.currentTextChanged.connect(self._show_view)
        self.tool.currentTextChanged.connect(self._set_tool)
        self.marker.changed.connect(self._take_marks)
        self.slider.valueChanged.connect(lambda value: self.compare.set_share(value / 100))
        bench.listen(Topic.SCENE, self._forget)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.refresh)
        self._timer.start(POLL_MS)
        self.refresh()

    def _button(self, text: str, action: str, *, tip: str = "") -> QPushButton:
        """A button that does an action of the workbench."""
        button = QPushButton(text)
        button.setToolTip(tip)
        button.clicked.connect(lambda: self._bench.do(action))
        return button

    def _lay_out(self) -> None:
        bottom = QHBoxLayout()
        top = WrappingRow((self.load_button, self.views, self.tool, self.clear_button, self.large))
        bottom.addWidget(self.name, 1)
        buttons = WrappingRow(
            (self.cut_button, self.clean_button, self.sharpen_button, self.undo_button)
        )
        layout = QVBoxLayout(self)
        layout.addLayout(top)
        layout.addWidget(self.marker, 1)
        self._column = layout
        layout.addLayout(bottom)
        layout.addLayout(buttons)
        layout.addWidget(self.line)
        layout.addWidget(self.compare, 1)
        layout.addWidget(self.slider)
        for widget in (self.compare, self.slider):  # photos to mark have their place until then
            widget.hide()

    def load(self) -> None:
        """Draw the views of the scene that is open."""
        scene = Path(self._bench.document.scene)
        if not (scene / "scene.json").is_file():
            self.line.setText("Built-in rooms are left as they are: open a scene of your own.")
            return
        self._drawing = ViewPictures(scene)
        self.line.setText("drawing views …")

    def _enlarge(self, is_large: bool) -> None:
        """Mark in the middle of the window, or in the page again."""
        grid = self._bench.shared(ViewGrid)
        if grid is None:
            return
        if is_large:
            grid.cover(self.marker)
        else:
            grid.uncover(self.marker)
            self._column.insertWidget(1, self.marker, 1)
            self.marker.show()

    def hideEvent(self, event: QHideEvent) -> None:
        """The room is seen again while the page is not."""
        super().hideEvent(event)
        self.large.setChecked(False)

    def begin(self) -> None:
        """Begin to cut out what is marked.

        Raises:
            ValueError: nothing is marked, it has no name, or one runs already.
            OSError: the scene cannot be copied.
        """
        self._begin(Change.CUT)

    def clean(self) -> None:
        """Begin to take what is marked out of the room; see `begin`."""
        self._begin(Change.CLEAN)

    def sharpen(self) -> None:
        """Begin to train what is marked, or the object that is named, further; see `begin`."""
        self._begin(Change.SHARPEN)

    def _begin(self, change: Change) -> None:
        if self.job is not None and self.job.is_running:
            raise ValueError("the scene is being changed: wait for it")
        scene = Path(self._bench.document.scene)
        if not (scene / "scene.json").is_file():
            raise ValueError("built-in rooms are left as they are: open a scene of your own")
        self.job = CutJob(scene, self.name.text(), list(self.marks.values()), change=change)
        self.large.setChecked(False)
        self.line.setText(BEGUN[change])
        self.refresh()

    def undo(self) -> None:
        """Put back the scene before the last cut.

        Raises:
            ValueError: there was none.
            OSError: folders cannot be renamed.
        """
        if not self.kept:
            raise ValueError("nothing was changed here that could be undone")
        scene, kept = self.kept.pop()
        undo(scene, kept)
        self.line.setText(f"{SHAPES['good']} the scene is as it was")
        self._reopen(scene)
        self.refresh()

    def refresh(self) -> None:
        """Take what threads and processes have left."""
        busy = self.job is not None
        for button in (self.cut_button, self.clean_button):
            button.setEnabled(bool(self.marks) and not busy)
        self.sharpen_button.setEnabled(not busy)
        self.clear_button.setEnabled(bool(self.marks) and not busy)
        if self.job is not None and self.job.change is Change.SHARPEN and self.job.doing:
            self.line.setText(self.job.doing)
        self.undo_button.setEnabled(bool(self.kept) and not busy)
        if self._drawing is not None and (drawn := self._drawing.result.take()) is not None:
            self._drawing = None
            self._show_pictures(drawn)
        if self._after is not None and (drawn := self._after.result.take()) is not None:
            self._after = None
            if not isinstance(drawn, str):
                name = next(iter(drawn))
                for widget in (self.compare, self.slider):
                    widget.show()
                self.compare.show_images(image_of(self._pictures[name]), image_of(drawn[name]))
        if self.job is not None and not self.job.is_running:
            job, self.job = self.job, None
            self._end(job)

    def _end(self, job: CutJob) -> None:
        if job.problem:
            self.line.setText(f"{SHAPES['bad']} {job.problem}")
            self._bench.say("error", job.problem)
            return
        try:
            self.kept.append((job.scene, job.take()))
        except OSError as error:
            what = f"{job.scene}: the changed scene cannot be put in place: {error}"
            self._bench.say("error", what)
            return
        self.line.setText(f"{SHAPES['good']} {_done(job.report)}")
        self._after = ViewPictures(job.scene, tuple(self.marks)[:1])
        self.marks.clear()
        self._show_view(self.views.currentText())
        self._reopen(job.scene)

    def _reopen(self, scene: Path) -> None:
        if "file.open_scene" in self._bench.actions:
            self._bench.do("file.open_scene", scene=str(scene))

    def _show_pictures(self, drawn: Pictures | str) -> None:
        if isinstance(drawn, str):
            self.line.setText(f"{SHAPES['bad']} {drawn}")
            return
        self._pictures = drawn
        self.line.setText(
            "Mark an object in 1 to 3 views to cut it out, or what is to go to remove its splats."
        )
        self.views.clear()
        self.views.addItems(list(drawn))
        is_in_window = self._bench.shared(ViewGrid) is not None
        self.large.setEnabled(is_in_window)
        self.large.setChecked(is_in_window)

    def _show_view(self, name: str) -> None:
        if name not in self._pictures:
            return
        self.marker.show_image(image_of(self._pictures[name]))
        mark = self.marks.get(name)
        if mark is not None:
            self.marker.set_marks(mark.box, mark.clicks, mark.outlines, mark.strokes)

    def _set_tool(self, tool: str) -> None:
        self.marker.tool = MarkTool(tool)

    def _clear(self) -> None:
        self.marker.clear()
        self._take_marks()

    def _take_marks(self) -> None:
        name = self.views.currentText()
        drawn, marker = self.marks, self.marker
        drawn[name] = Mark(
            name,
            marker.box,
            tuple(marker.points),
            tuple(marker.outlines),
            tuple(marker.strokes),
        )
        if drawn[name].is_empty:
            del drawn[name]
        self.refresh()

    def _forget(self) -> None:
        if self.kept and self.kept[-1][0] != Path(self._bench.document.scene):
            self._pictures, self.marks = {}, {}
            self.views.clear()
            self.marker.show_image(QImage())

    def closeEvent(self, event: QCloseEvent) -> None:
        """End what runs; the scene is as it was."""
        if self.job is not None:
            self.job.cancel()
        event.accept()


def _done(report: dict[str, Any]) -> str:
    """Words for what `nexus cut --json` or `nexus refine --json` reports."""
    if "refined" in report:
        return "\n".join(_sharpened(row) for row in report["refined"])
    if "cleaned" in report:
        return f"{report['cleaned']:,} splats removed"
    size = " × ".join(f"{side:g}" for side in report["box_cm"])
    found = (
        f"{report['object']}: {report['splats']:,} splats, {size} cm, "
        f"{report['floaters']} floaters removed; {report['seen_words']}"
    )
    return "\n".join([found, *report["notes"]])


def _sharpened(row: dict[str, Any]) -> str:
    """Words for one object or region of what `nexus refine --json` reports."""
    words = f"{row['name']}: {row['splats']:,} splats of {row['photos']} photos"
    if row["after_db"] is None:
        return words
    return f"{words}, {row['before_db']} → {row['after_db']} dB on photos kept aside"


def image_of(picture: NDArray[np.uint8]) -> QImage:
    """(H, W, 3) RGB as Qt's picture, with its own memory."""
    rows = np.ascontiguousarray(picture)
    height, width = rows.shape[:2]
    return QImage(rows.data, width, height, 3 * width, QImage.Format.Format_RGB888).copy()
