"""A row of controls that goes on in the next line where it does not fit."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtWidgets import QHBoxLayout, QLayout, QLayoutItem, QWidget


class WrappingRow(QLayout):
    """Beside each other as far as they fit, each as wide as it would be; what can grow fills lines.

    Args:
        widgets: from the left.
        gap_px: between two, and between lines.
    """

    def __init__(self, widgets: Sequence[QWidget] = (), *, gap_px: int = 6) -> None:
        super().__init__()
        self._items: list[QLayoutItem] = []
        self._gap = gap_px
        self.setContentsMargins(0, 0, 0, 0)
        for widget in widgets:
            self.addWidget(widget)

    def addItem(self, item: QLayoutItem) -> None:
        """See Qt."""
        self._items.append(item)

    def count(self) -> int:
        """See Qt."""
        return len(self._items)

    def itemAt(self, index: int) -> QLayoutItem | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """See Qt."""
        return self._items[index] if 0 <= index < len(self._items) else None

    def takeAt(self, index: int) -> QLayoutItem | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """See Qt."""
        return self._items.pop(index) if 0 <= index < len(self._items) else None

    def expandingDirections(self) -> Qt.Orientation:
        """See Qt."""
        return Qt.Orientation.Horizontal

    def hasHeightForWidth(self) -> bool:
        """See Qt."""
        return True

    def heightForWidth(self, width: int) -> int:
        """See Qt."""
        edge = self.contentsMargins()
        lines = self._lines(width - edge.left() - edge.right())
        gaps = self._gap * max(len(lines) - 1, 0)
        return sum(_height(line) for line in lines) + gaps + edge.top() + edge.bottom()

    def sizeHint(self) -> QSize:
        """See Qt: all of it in one line."""
        shown = self._shown()
        wide = sum(item.sizeHint().width() for item in shown) + self._gap * max(len(shown) - 1, 0)
        return self._with_edge(QSize(wide, _height(shown)))

    def minimumSize(self) -> QSize:
        """See Qt: the widest of them."""
        shown = self._shown()
        wide = max((_width(item) for item in shown), default=0)
        return self._with_edge(QSize(wide, _height(shown)))

    def setGeometry(self, rect: QRect) -> None:
        """See Qt."""
        super().setGeometry(rect)
        rect = rect.marginsRemoved(self.contentsMargins())
        top = rect.top()
        for line in self._lines(rect.width()):
            height = _height(line)
            free = rect.width() - sum(map(_width, line)) - self._gap * (len(line) - 1)
            growing = [item for item in line if _grows(item)]
            left = rect.left()
            for item in line:
                wide = _width(item) + (max(free, 0) // len(growing) if item in growing else 0)
                wide = min(wide, rect.width())
                item.setGeometry(QRect(left, top, wide, height))
                left += wide + self._gap
            top += height + self._gap

    def _with_edge(self, size: QSize) -> QSize:
        edge = self.contentsMargins()
        return size + QSize(edge.left() + edge.right(), edge.top() + edge.bottom())

    def _shown(self) -> list[QLayoutItem]:
        return [item for item in self._items if not item.isEmpty()]

    def _lines(self, width: int) -> list[list[QLayoutItem]]:
        lines: list[list[QLayoutItem]] = []
        used = width + 1
        for item in self._shown():
            wide = _width(item)
            if not lines or used + self._gap + wide > width:
                lines.append([])
                used = -self._gap
            lines[-1].append(item)
            used += self._gap + wide
        return lines


def together(*widgets: QWidget) -> QWidget:
    """Widgets that stay in one line, the last one as wide as there is room."""
    whole = QWidget()
    row = QHBoxLayout(whole)
    row.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        row.addWidget(widget, 1 if widget is widgets[-1] else 0)
    return whole


def _grows(item: QLayoutItem) -> bool:
    return bool(item.expandingDirections() & Qt.Orientation.Horizontal)


def _width(item: QLayoutItem) -> int:
    """Return an item's width: the least of one that grows, else that of its words."""
    return item.minimumSize().width() if _grows(item) else item.sizeHint().width()


def _height(line: Sequence[QLayoutItem]) -> int:
    return max((item.sizeHint().height() for item in line), default=0)
