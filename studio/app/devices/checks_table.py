"""The list of checks: verdict, what was looked at, what was found and what to do."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QColor, QResizeEvent
from PySide6.QtWidgets import QHeaderView, QTreeWidget, QTreeWidgetItem

from studio.app.shell.theme import SHAPES, Theme
from studio.session.preflight import Check

KINDS = {"PASS": "good", "WARN": "warning", "FAIL": "bad"}
"""A verdict's colour and shape."""

VERDICTS = {"PASS": "ready", "WARN": "ready, with warnings", "FAIL": "not ready"}
"""Of all checks together, in words."""


MARGIN_PX = 8
"""Around an item's text, as the style sheet has it and some more."""


class ChecksTable(QTreeWidget):
    """One line a check; what to do stands below what was found."""

    def __init__(self) -> None:
        super().__init__()
        self.setHeaderLabels(["", "Check", "Found"])
        self.setRootIsDecorated(False)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.header().setStretchLastSection(True)
        self.setWordWrap(True)

    def show_checks(self, checks: Sequence[Check], theme: Theme) -> None:
        """Show these."""
        self.clear()
        for check in checks:
            found = f"{check.what}\n→ {check.fix}" if check.fix else check.what
            kind = KINDS[check.verdict]
            item = QTreeWidgetItem([f"{SHAPES[kind]} {check.verdict}", check.name, found])
            item.setForeground(0, QColor(getattr(theme, kind)))
            item.setToolTip(2, found)
            self.addTopLevelItem(item)
        for column in (0, 1):
            self.resizeColumnToContents(column)
        self._fit_rows()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self._fit_rows()

    def _fit_rows(self) -> None:
        """Rows as high as what was found takes in its column: the view counts two lines at most."""
        width_px = max(self.columnWidth(2) - 2 * MARGIN_PX, 1)
        for place in range(self.topLevelItemCount()):
            item = self.topLevelItem(place)
            assert item is not None
            box = QRect(0, 0, width_px, 10_000)
            flags = int(Qt.TextFlag.TextWordWrap) | int(Qt.TextFlag.TextWrapAnywhere)
            height_px = self.fontMetrics().boundingRect(box, flags, item.text(2)).height()
            item.setSizeHint(2, QSize(width_px, height_px + MARGIN_PX))
