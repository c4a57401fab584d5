"""Two runs side by side: pictures of one instant, and the figures that differ."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, Qt
from PySide6.QtGui import QCloseEvent, QMouseEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QSlider,
    QSplitter,
    QStyle,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from devices.clock import WallClock
from studio.app.timeline.comparison.beside import Beside, Called
from studio.app.timeline.comparison.forking import TwoRuns
from studio.app.timeline.playback import Playback
from studio.compare.verdicts import Compared
from studio.console.spoken import UNITS, spoken
from studio.console.spoken import Called as Names

COLUMNS = ("Figure", "A", "B", "B − A", "Unit", "Verdict")
SHARES = (3, 2)
"""Of the width: pictures and table."""
SLIDER_STEP_NS = 10_000_000
"""Of the slider: a hundredth of a second, below a frame of any camera."""
Index = QModelIndex | QPersistentModelIndex
ROOT = QModelIndex()


class ComparedModel(QAbstractTableModel):
    """Compared figures as a table.

    Args:
        rows: the figures.
        called: what the object of an id is called.
    """

    def __init__(self, rows: Sequence[Compared], called: Names) -> None:
        super().__init__()
        self._rows, self._called = rows, called

    def rowCount(self, parent: Index = ROOT) -> int:
        """See Qt."""
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: Index = ROOT) -> int:
        """See Qt."""
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """See Qt."""
        if orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.DisplayRole:
            return COLUMNS[section]
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """See Qt."""
        if role == Qt.ItemDataRole.TextAlignmentRole and index.column() in (1, 2, 3):
            return int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        row = self._rows[index.row()]
        if role == Qt.ItemDataRole.ToolTipRole:
            return row.name
        if role != Qt.ItemDataRole.DisplayRole:
            return None
        sign = "✖ " if row.worse else "● " if row.verdict in ("same", "better") else "○ "
        numbers = (_number(row.a), _number(row.b), _number(row.difference, "+"))
        unit = UNITS.get(row.unit, row.unit)
        return (spoken(row.name, self._called), *numbers, unit, sign + row.verdict)[index.column()]


class ComparisonView(QWidget):
    """Both runs at one instant, a slider over their time, and the table of figures.

    Args:
        close: goes back to the timeline.
        open_page: opens the whole comparison as a page.
        scrub: takes a time that was dragged to, and whether the drag has ended.
        called: what an object is called in a scene.
        cover: shows the pictures in place of the window's views, or these again; whether there
            are views.
    """

    def __init__(
        self,
        close: Callable[[], object],
        open_page: Callable[[], object],
        scrub: Callable[[int, bool], object],
        called: Called,
        cover: Callable[[QWidget, bool], bool],
    ) -> None:
        super().__init__()
        self.playback: Playback | None = None
        """Of both runs; None while nothing is compared."""
        self._scrub, self._cover, self._called = scrub, cover, called
        self._shown_ns = -1
        self.table = _table()
        self.beside = Beside(called)
        self.headline = QLabel()
        self.back, page = QPushButton("Back to the timeline"), QPushButton("Open page")
        self.back.clicked.connect(lambda: close())
        page.clicked.connect(lambda: open_page())
        top = QHBoxLayout()
        top.addWidget(self.back)
        top.addWidget(self.headline, 1)
        top.addWidget(page)
        self.slider = _TimeSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName("Time of both runs")
        self.slider.valueChanged.connect(self._on_slider)
        self.slider.sliderReleased.connect(self._on_released)
        self._split = QSplitter(Qt.Orientation.Horizontal)
        self._split.addWidget(self.beside)
        self._split.addWidget(self.table)
        self._share_width()
        self._split.setChildrenCollapsible(False)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(8, 0, 8, 6)
        whole.setSpacing(4)
        whole.addLayout(top)
        whole.addWidget(self.slider)
        whole.addWidget(self._split, 1)

    def _share_width(self) -> None:
        for place, share in enumerate(SHARES):
            self._split.setStretchFactor(place, share)
        self._split.setSizes([1000 * share for share in SHARES])

    def show_comparison(self, compared: TwoRuns) -> None:
        """Show two runs, from where they differ."""
        comparison = compared.comparison
        called = partial(self._called, scene=comparison.scene)
        rows = sorted(comparison.rows, key=lambda row: not row.worse)
        self._model = ComparedModel(rows, called)
        self.table.setModel(self._model)
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)
        count = len(comparison.worse)
        sign = "✖" if count else "●"
        self.headline.setText(
            f"{sign} A {comparison.a.folder.name}, B {comparison.b.folder.name}: "
            f"{count} of {len(comparison.rows)} figures got worse"
        )
        indexes = [run.index for run in compared.recordings]
        start_ns, end_ns = min(i.start_ns for i in indexes), max(i.end_ns for i in indexes)
        frames = sorted({t for index in indexes for t in index.frames_ns.tolist()})
        self.playback = Playback(frames, start_ns=start_ns, end_ns=end_ns, clock=WallClock())
        self.slider.blockSignals(True)
        self.slider.setRange(start_ns // SLIDER_STEP_NS, end_ns // SLIDER_STEP_NS)
        self.slider.blockSignals(False)
        self._cover(self.beside, True)
        self.beside.open(compared.recordings, comparison.scene)
        fork_s = comparison.b.fork_s or 0.0
        self.playback.seek(round(fork_s * 1e9))
        self._shown_ns = -1
        self.show_instant()

    def show_instant(self) -> None:
        """Show both runs where the playhead is."""
        if self.playback is None or self.playback.t_ns == self._shown_ns:
            return
        self._shown_ns = self.playback.t_ns
        self.slider.blockSignals(True)
        self.slider.setValue(self._shown_ns // SLIDER_STEP_NS)
        self.slider.blockSignals(False)
        self.beside.show_instant(self._shown_ns)

    def leave(self) -> None:
        """End the threads that draw; the window's views are seen again."""
        self.beside.close_runs()
        if self.playback is not None and self._cover(self.beside, False):
            self._split.insertWidget(0, self.beside)
            self._share_width()
        self.playback = None

    def _on_slider(self, value: int) -> None:
        self._scrub(value * SLIDER_STEP_NS, not self.slider.isSliderDown())

    def _on_released(self) -> None:
        self._scrub(self.slider.value() * SLIDER_STEP_NS, True)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the threads that draw."""
        self.leave()
        event.accept()


class _TimeSlider(QSlider):
    """A slider that goes to where it is pressed, and is dragged on from there."""

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        if event.button() == Qt.MouseButton.LeftButton:
            x, width = round(event.position().x()), self.width()
            low, high = self.minimum(), self.maximum()
            self.setValue(QStyle.sliderValueFromPosition(low, high, x, width))
        super().mousePressEvent(event)


def _table() -> QTableView:
    table = QTableView()
    table.setAlternatingRowColors(True)
    table.setShowGrid(False)
    table.setMinimumWidth(200)
    table.setSelectionBehavior(QTableView.SelectionBehavior.SelectRows)
    table.verticalHeader().hide()
    table.verticalHeader().setDefaultSectionSize(22)
    left = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
    table.horizontalHeader().setDefaultAlignment(left)
    return table


def _number(value: float | None, sign: str = "") -> str:
    return "" if value is None else f"{value:{sign}.3f}"
