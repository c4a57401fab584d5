"""How long each stage takes, as one stacked bar for the median and one for the 95th percentile."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.session.latency import StageTime

FILLS = ("#2f7fb8", "#8a6fc0", "#2d9170", "#b57a1f", "#b4556e", "#6b7d8f")
"""Of stages in their order, distinguished by their numbers too; white text has 3:1 on each."""
LEAST_LABEL_PX = 18
"""Parts narrower than this have no number in them."""


class LatencyBar(QWidget):
    """Two bars with the stages' numbers in them, and a key below."""

    def __init__(self) -> None:
        super().__init__()
        self._stages: tuple[StageTime, ...] = ()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Time per stage")

    def show_stages(self, stages: Sequence[StageTime]) -> None:
        """Show these."""
        self._stages = tuple(stages)
        self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        """See Qt."""
        lines = 3 + len(self._stages)
        return QSize(260, int(lines * 1.5 * self.fontMetrics().height()) + 4)

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        painter = QPainter(self)
        line_px = 1.5 * self.fontMetrics().height()
        text = self.palette().windowText().color()
        painter.setPen(text)
        if not self._stages:
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, "no session yet")
            return
        label_px = self.fontMetrics().horizontalAdvance("p95 000.0 ms  ")
        longest = max(sum(s.p95_ms for s in self._stages), 1e-9)
        for row, name in enumerate(("p50", "p95")):
            times = [getattr(stage, f"{name}_ms") for stage in self._stages]
            top = row * line_px
            painter.setPen(text)
            flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft
            words = f"{name} {sum(times):6.1f} ms"
            painter.drawText(QRectF(0, top, label_px, line_px), flags, words)
            left = float(label_px)
            for place, time_ms in enumerate(times):
                width = (self.width() - label_px) * time_ms / longest
                part = QRectF(left, top + 2, width, line_px - 4)
                painter.fillRect(part, QColor(FILLS[place % len(FILLS)]))
                if width >= LEAST_LABEL_PX:
                    painter.setPen(QColor("#ffffff"))
                    painter.drawText(part, Qt.AlignmentFlag.AlignCenter, str(place + 1))
                left += width
        for place, stage in enumerate(self._stages):
            top = (2.5 + place) * line_px
            box = QRectF(0, top + 3, line_px - 6, line_px - 6)
            painter.fillRect(box, QColor(FILLS[place % len(FILLS)]))
            painter.setPen(QColor("#ffffff"))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, str(place + 1))
            painter.setPen(text)
            row = QRectF(line_px, top, self.width() - line_px, line_px)
            painter.drawText(row, Qt.AlignmentFlag.AlignVCenter, stage.name)
            figures = f"{stage.p50_ms:6.1f} / {stage.p95_ms:6.1f} ms"
            flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight
            painter.drawText(row, flags, figures)
