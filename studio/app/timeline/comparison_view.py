"""Figures of two runs side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, Qt
from PySide6.QtWidgets import (
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from studio.compare.verdicts import Compared

if TYPE_CHECKING:
    from studio.compare.comparison import Comparison

COLUMNS = ("Figure", "A", "B", "B less A", "Unit", "Verdict")
Index = QModelIndex | QPersistentModelIndex
ROOT = QModelIndex()


class ComparedModel(QAbstractTableModel):
    """Compared figures as a table.

    Args:
        rows: the figures.
    """

    def __init__(self, rows: Sequence[Compared]) -> None:
        super().__init__()
        self._rows = rows

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
        if role != Qt.ItemDataRole.DisplayRole:
            return None
        row = self._rows[index.row()]
        sign = "✖ " if row.worse else "● " if row.verdict in ("same", "better") else "○ "
        cells = (row.name, _number(row.a), _number(row.b), _number(row.difference, "+"), row.unit)
        return (*cells, sign + row.verdict)[index.column()]


class ComparisonView(QWidget):
    """The table, a headline, and what can be done with it.

    Args:
        close: goes back to the timeline.
        open_page: opens the whole comparison as a page.
    """

    def __init__(self, close: Callable[[], object], open_page: Callable[[], object]) -> None:
        super().__init__()
        self.table = QTableView()
        self.table.setAlternatingRowColors(True)
        self.table.verticalHeader().hide()
        self.table.verticalHeader().setDefaultSectionSize(22)
        left = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
        self.table.horizontalHeader().setDefaultAlignment(left)
        self.headline = QLabel()
        back, page = QPushButton("Back to the timeline"), QPushButton("Open page")
        back.clicked.connect(lambda: close())
        page.clicked.connect(lambda: open_page())
        top = QHBoxLayout()
        top.addWidget(back)
        top.addWidget(self.headline, 1)
        top.addWidget(page)
        whole = QVBoxLayout(self)
        whole.addLayout(top)
        whole.addWidget(self.table)

    def show_comparison(self, comparison: Comparison) -> None:
        """Show two runs."""
        self._model = ComparedModel(comparison.rows)
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


def _number(value: float | None, sign: str = "") -> str:
    return "" if value is None else f"{value:{sign}.3f}"
