"""The tracker's errors of the last trial as bars, with those of the one before for comparison."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.app.scenario.colours import theme_of
from studio.app.scenario.faults.trial import ObjectError

ROW_PX, HEAD_PX, NAME_PX, NUMBER_PX, GAP_PX = 26, 22, 84, 46, 8
FAINT = 0.45
"""How strongly errors are drawn that are no longer of what the scenario says."""
COLUMNS = (
    ("position, cm", lambda e: e.position_cm, 10.0, "{:.1f}"),
    ("yaw, °", lambda e: e.yaw_deg, 10.0, "{:.1f}"),
    ("lost, %", lambda e: 100.0 * e.lost, 100.0, "{:.0f}"),
)
"""Title, value, what a full bar at least stands for, and how the number is written."""


class ErrorBars(QWidget):
    """A row an object: filled bars are the last trial, the hollow mark is the one before.

    Args:
        name: gives what an object of an id is called.
    """

    def __init__(self, name: Callable[[str], str]) -> None:
        super().__init__()
        self._name = name
        self._now: Mapping[str, ObjectError] = {}
        self._before: Mapping[str, ObjectError] = {}
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Errors of the tracker")
        self.setMinimumWidth(280)

    def show_errors(
        self, now: Mapping[str, ObjectError], before: Mapping[str, ObjectError]
    ) -> None:
        """Show a trial's errors beside those of the trial before, by object."""
        self._now, self._before = now, before
        self.setFixedHeight(self.sizeHint().height())
        self.setToolTip("\n".join(self._words(k) for k in now))
        self.update()

    def sizeHint(self) -> QSize:
        """See Qt."""
        return QSize(320, HEAD_PX + ROW_PX * max(1, len(self._now)) + 4)

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        painter, theme = QPainter(self), theme_of(self)
        painter.setOpacity(1.0 if self.isEnabled() else FAINT)
        width = (self.width() - NAME_PX) / len(COLUMNS)
        painter.setPen(QColor(theme.faint))
        for k, (title, _, _, _) in enumerate(COLUMNS):
            painter.drawText(QRectF(NAME_PX + k * width, 0, width, HEAD_PX), _LEFT, title)
        for row, (object_id, error) in enumerate(self._now.items()):
            top = HEAD_PX + row * ROW_PX
            painter.setPen(QColor(theme.text if error.has_moved else theme.faint))
            name = painter.fontMetrics().elidedText(
                self._name(object_id), Qt.TextElideMode.ElideRight, NAME_PX - 6
            )
            painter.drawText(QRectF(0, top, NAME_PX, ROW_PX), _LEFT, name)
            for k in range(len(COLUMNS)):
                rect = QRectF(NAME_PX + k * width, top, width - GAP_PX, ROW_PX)
                self._draw(painter, rect, k, object_id)

    def _draw(self, painter: QPainter, rect: QRectF, column: int, object_id: str) -> None:
        theme = theme_of(self)
        _, value_of, least, form = COLUMNS[column]
        values = [value_of(e) for e in (*self._now.values(), *self._before.values())]
        full = max([least, *values])
        now, old = self._now[object_id], self._before.get(object_id)
        value = value_of(now)
        room = rect.width() - NUMBER_PX
        bar = QRectF(rect.left(), rect.top() + 7, max(2.0, room * value / full), ROW_PX - 14)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.raised))
        painter.drawRect(QRectF(rect.left(), rect.top() + 7, room, ROW_PX - 14))
        is_worse = old is not None and value > value_of(old) + 0.02 * full
        is_better = old is not None and value < value_of(old) - 0.02 * full
        colour = theme.bad if is_worse else theme.good if is_better else theme.accent
        painter.setBrush(QColor(colour))
        painter.drawRect(bar)
        if old is not None:
            x = rect.left() + room * value_of(old) / full
            painter.setPen(QPen(QColor(theme.text), 2))
            painter.drawLine(round(x), round(rect.top()) + 4, round(x), round(rect.top()) + 22)
        painter.setPen(QColor(theme.text))
        sign = "▲" if is_worse else "▼" if is_better else ""
        where = QRectF(rect.right() - NUMBER_PX, rect.top(), NUMBER_PX, ROW_PX)
        painter.drawText(
            where, _RIGHT, f"{sign}{form.format(value) if value < 100 else round(value)}"
        )

    def _words(self, object_id: str) -> str:
        error, old = self._now[object_id], self._before.get(object_id)
        words = f"{self._name(object_id)}: {error.position_cm:.1f} cm, {error.yaw_deg:.1f}°"
        words += f", lost {error.lost:.0%}" + ("" if error.has_moved else " (at rest)")
        if old is None:
            return words
        return f"{words}; before {old.position_cm:.1f} cm, {old.yaw_deg:.1f}°, lost {old.lost:.0%}"


_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
