"""The page on which a room is prepared: source, scale, stages, what came out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QColor, QDragEnterEvent, QDropEvent, QPixmap, QResizeEvent
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.documents.dropped import (
    MESHES,
    PICTURES,
    SPLATS,
    VIDEOS,
    photos_of,
    poses_in,
)
from studio.app.model.workbench import Workbench
from studio.app.preparation.length_picker import LengthPicker
from studio.app.preparation.preparation_job import (
    UNKNOWN_SCALE,
    PreparationJob,
    Scale,
    place_of_room,
    preparation_words,
    splat_file_words,
)
from studio.app.preparation.stage_lines import StageLine
from studio.app.shell.theme import SHAPES, THEMES
from studio.app.shell.wrapping import WrappingRow

NOTHING = "Drop a video, a folder of photos,\na splat file or a mesh here, or click"
SCALE = (
    "How large it is: the side of a printed code in the pictures, or one known length. Leave all "
    "empty where codes with their size in them are seen."
)
POLL_MS = 300
STATES = {"running": ("calm", "runs"), "done": ("good", "done"), "failed": ("bad", "failed")}
NAMES = {"outdoor points": "outside the windows"}
"""Stages whose names say too little, as people read them."""
BAR_CELLS = 10
QUALITIES = {
    "preview": "preview: trains half a minute",
    "default": "usual: trains two and a half minutes",
    "fine": "fine: trains eight minutes",
}
"""Titles of the qualities; times of two idle cores."""

ALL_ELSE = (
    "All else takes some minutes more, mostly to find where the photos were taken; a busy computer "
    "takes twice as long. Left says what is left of a stage."
)
PREVIEW_PX = 280
"""Widest that a picture of the training is shown."""
MARGIN_PX = 28
"""Of the page, left and right together."""


class RoomPage(QScrollArea):
    """Source, scale, stages, result.

    Args:
        bench: gets what is to be said, and opens the room when it is ready.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.source: Path | None = None
        self.mesh: Path | None = None
        self.job: PreparationJob | None = None
        self._is_open = False
        self._preview: Path | None = None
        self._pixmap = QPixmap()
        self.setAcceptDrops(True)
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self._make_source()
        form = self._make_form()
        buttons = self._make_buttons()
        self._make_results()
        self._lay_out(form, buttons)
        for field in (self.metres, self.ceiling):
            field.valueChanged.connect(self._show_notice)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.refresh)
        self._timer.start(POLL_MS)
        self.refresh()

    def _make_source(self) -> None:
        self.drop = QLabel(NOTHING)
        self.drop.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.drop.setFrameShape(QLabel.Shape.StyledPanel)
        self.drop.setMinimumHeight(64)
        self.drop.setWordWrap(True)
        self.drop.setCursor(Qt.CursorShape.PointingHandCursor)
        self.drop.installEventFilter(self)
        self.browse_video = _browse("Video …", "a video, a splat file or a mesh", self._ask_file)
        self.browse_photos = _browse("Photos …", "a folder of photos", self._ask_photos)
        self.browse_package = _browse(
            "Package …", "a room package (.gnx) that is there already", self._ask_package
        )
        self.notice = QLabel()
        self.notice.setWordWrap(True)
        self.notice.hide()

    def _make_form(self) -> QFormLayout:
        self.code_side = _length(" m", "not used", 5.0)
        self.metres = _length(" m", "not used", 1000.0)
        self.ceiling = _length(" m", "not used", 12.0)
        self.quality = QComboBox()
        self.quality.setAccessibleName("Quality")
        for name, words in QUALITIES.items():
            self.quality.addItem(words, name)
        self.quality.setCurrentIndex(list(QUALITIES).index("default"))
        self.quality.setMinimumContentsLength(8)
        self.quality.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        form = QFormLayout()
        form.setRowWrapPolicy(QFormLayout.RowWrapPolicy.WrapLongRows)
        form.addRow("Quality", self.quality)
        form.addRow("Printed code, side", self.code_side)
        form.addRow("Splat file, one unit", self.metres)
        form.addRow("or floor to ceiling", self.ceiling)
        return form

    def _make_buttons(self) -> QHBoxLayout:
        self.start_button, self.cancel_button = QPushButton("Prepare"), QPushButton("Cancel")
        self.start_button.clicked.connect(lambda: self._bench.do("preparation.start"))
        self.cancel_button.clicked.connect(lambda: self._bench.do("preparation.cancel"))
        buttons = QHBoxLayout()
        buttons.addWidget(self.start_button, 1)
        buttons.addWidget(self.cancel_button)
        return buttons

    def _make_results(self) -> None:
        self.ends = LengthPicker()
        self.ends.hide()
        self.stages = _table(["Stage", "State", "Done", "Left"])
        self.stages.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.preview = QLabel()
        self.preview.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.preview.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.codes = _table(["Code", "Side", "Photos", "Off by"])
        self.verdict = QLabel()
        self.verdict.setWordWrap(True)
        self.codes.hide()
        self.stages.hide()

    def _lay_out(self, form: QFormLayout, buttons: QHBoxLayout) -> None:
        page = QWidget()
        layout = QVBoxLayout(page)
        layout.addWidget(self.drop)
        layout.addLayout(
            WrappingRow(
                (QLabel("Browse:"), self.browse_video, self.browse_photos, self.browse_package)
            )
        )
        layout.addWidget(self.notice)
        words = QLabel(SCALE)
        words.setObjectName("faint")
        words.setWordWrap(True)
        layout.addWidget(words)
        layout.addLayout(form)
        times = QLabel(ALL_ELSE)
        times.setObjectName("faint")
        times.setWordWrap(True)
        layout.addWidget(times)
        layout.addWidget(self.ends)
        layout.addLayout(buttons)
        layout.addWidget(self.stages)
        layout.addWidget(self.preview)
        layout.addWidget(self.codes)
        layout.addWidget(self.verdict)
        layout.addStretch(1)
        self.setWidget(page)

    def add(self, path: Path) -> None:
        """Take what was dropped; of a photo, all in its folder.

        Raises:
            ValueError: it is not there.
        """
        if not path.exists():
            raise ValueError(f"{path}: there is no such file or folder")
        path = path.parent if path.suffix.lower() in PICTURES and path.is_file() else path
        if path.suffix.lower() in MESHES:
            self.mesh = path
        else:
            self.source = path
            self.ends.show_photos(photos_of(path) if path.is_dir() else path)
        names = [item.name for item in (self.source, self.mesh) if item is not None]
        poses = poses_in(path) if path.is_dir() else None
        words = [] if poses is None else [f"with the poses of {poses.name}"]
        self.drop.setText("\n".join(["\n+ mesh ".join(names), *words]))
        self._show_notice()
        self.refresh()

    def scale(self) -> Scale:
        """The scale that the fields give."""
        values = [field.value() or None for field in (self.code_side, self.metres, self.ceiling)]
        return Scale(code_side_m=values[0], metres_per_unit=values[1], height_m=values[2])

    def begin(self) -> None:
        """Begin to prepare.

        Raises:
            ValueError: nothing was dropped, one runs already, or the scale is missing.
        """
        if self.source is None:
            raise ValueError("nothing to prepare yet: drop a video or a folder of photos")
        if self.job is not None and self.job.is_running:
            raise ValueError("a preparation is running: cancel it first")
        out = place_of_room(self.source)
        if self._is_splat_file:
            words = splat_file_words(self.source, out, self.scale())
        else:
            length_m, ends = self.ends.length_m, self.ends.picks()
            only = Scale(self.scale().code_side_m, length_m, ends if length_m else None)
            quality = str(self.quality.currentData())
            words = preparation_words(self.source, out, only, quality=quality)
            words += [] if self.mesh is None else ["--mesh", str(self.mesh)]
        self.job, self._is_open, self._preview = PreparationJob(words, out), True, None
        self.codes.hide()
        self.verdict.clear()
        self.refresh()

    def cancel(self) -> None:
        """Ask what runs to end."""
        if self.job is not None:
            self.job.cancel()

    @property
    def _is_splat_file(self) -> bool:
        return self.source is not None and self.source.suffix.lower() in SPLATS

    def _show_notice(self) -> None:
        unknown = self._is_splat_file and not self.scale().is_known
        self.notice.setText(f"{SHAPES['warning']} {UNKNOWN_SCALE}")
        self.notice.setVisible(unknown)

    def refresh(self) -> None:
        """Show how far it is."""
        running = self.job is not None and self.job.is_running
        self.start_button.setEnabled(self.source is not None and not running)
        self.cancel_button.setEnabled(running)
        if self.job is None or not self._is_open:
            return
        self._show_stages(self.job.stages)
        self.stages.show()
        picture = self.job.preview
        if picture is not None and picture != self._preview:
            pixmap = QPixmap(str(picture))
            if not pixmap.isNull():
                self._preview, self._pixmap = picture, pixmap
                self._show_preview()
        if not running:
            self._is_open = False
            self._end(self.job)

    def _show_preview(self) -> None:
        """As wide as the page lets it be: what is wider would be cut off."""
        if not self._pixmap.isNull():
            smooth = Qt.TransformationMode.SmoothTransformation
            width = max(1, min(PREVIEW_PX, self.viewport().width() - MARGIN_PX))
            self.preview.setPixmap(self._pixmap.scaledToWidth(width, smooth))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self._show_preview()

    def _end(self, job: PreparationJob) -> None:
        if job.problem:
            self.verdict.setText(f"{SHAPES['bad']} {job.problem}")
            self._bench.say(
                "warning" if job.problem.startswith("cancelled") else "error", job.problem
            )
            return
        found = job.outcome
        self.codes.clear()
        for code in found.get("codes", []):
            side, off = f"{1000 * code['side_m']:.0f} mm", f"{code['residual_mm']:5.2f} mm"
            values = [code["payload"], side, str(code["photos"]), off]
            self.codes.addTopLevelItem(QTreeWidgetItem(values))
        self.codes.setVisible(bool(found.get("codes")))
        lines = [f"{SHAPES['good' if found.get('good', True) else 'warning']} "]
        lines[0] += found.get("headline", f"{job.out.name} is ready")
        if found:
            size = [high - low for low, high in zip(found["low_m"], found["high_m"], strict=True)]
            words = " × ".join(f"{side:.1f}" for side in size)
            lines.append(f"{found['splats']:,} splats, {words} m")
        lines += [f"{SHAPES['warning']} {note}" for note in found.get("notes", [])]
        self.verdict.setText("\n\n".join(lines))
        self._bench.say("info", f"{lines[0][2:]}: {job.out}")
        if "file.open_scene" in self._bench.actions:
            self._bench.do("file.open_scene", scene=str(job.out))

    def _show_stages(self, stages: tuple[StageLine, ...]) -> None:
        self.stages.clear()
        theme = THEMES[self._bench.settings.theme]
        for stage in stages:
            kind, words = STATES[stage.state]
            full = round(BAR_CELLS * stage.done)
            bar = f"{'▰' * full}{'▱' * (BAR_CELLS - full)} {100 * stage.done:3.0f} %"
            if stage.spent_s is not None:
                bar = f"took {stage.spent_s:.0f} s"
            is_left = stage.state == "running" and stage.left_s is not None
            left = f"{stage.left_s:4.0f} s" if is_left else ""
            name = NAMES.get(stage.name, stage.name)
            item = QTreeWidgetItem([name, f"{SHAPES[kind]} {words}", bar, left])
            item.setForeground(1, QColor(getattr(theme, kind)))
            item.setToolTip(0, stage.note)
            self.stages.addTopLevelItem(item)
        for column in range(3):
            self.stages.resizeColumnToContents(column)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See Qt: what asks to be dropped on can be clicked, too."""
        if watched is self.drop and event.type() == QEvent.Type.MouseButtonRelease:
            self._ask_file()
            return True
        return super().eventFilter(watched, event)

    def _ask_file(self) -> None:
        kinds = " ".join(f"*{suffix}" for suffix in sorted(VIDEOS | SPLATS | MESHES | PICTURES))
        chosen, _ = QFileDialog.getOpenFileName(self, "Prepare a room of", "", f"Files ({kinds})")
        if chosen:
            self._bench.do("preparation.add", path=chosen)

    def _ask_photos(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Prepare a room of the photos in")
        if chosen:
            self._bench.do("preparation.add", path=chosen)

    def _ask_package(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Open a room package (.gnx)")
        if chosen:
            self._bench.do("file.open_folder", path=chosen)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """See Qt."""
        if event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """See Qt."""
        for url in event.mimeData().urls():
            if url.isLocalFile():
                self._bench.do("preparation.add", path=url.toLocalFile())

    def closeEvent(self, event: QCloseEvent) -> None:
        """End what runs."""
        self.cancel()
        event.accept()


def _browse(words: str, hint: str, ask: Callable[[], None]) -> QPushButton:
    button = QPushButton(words)
    button.setToolTip(hint)
    button.clicked.connect(ask)
    return button


def _length(unit: str, none: str, most: float) -> QDoubleSpinBox:
    field = QDoubleSpinBox()
    field.setRange(0.0, most)
    field.setDecimals(3)
    field.setSingleStep(0.01)
    field.setSuffix(unit)
    field.setSpecialValueText(none)
    return field


def _table(titles: list[str]) -> QTreeWidget:
    table = QTreeWidget()
    table.setHeaderLabels(titles)
    table.setRootIsDecorated(False)
    table.setMinimumHeight(96)
    table.setMaximumHeight(180)
    return table
