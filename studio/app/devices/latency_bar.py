"""How long each stage takes, as one stacked bar for the median and one for the 95th percentile."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.session.latency import StageTime

FILLS = ("#2a76ad", "#7f64b6", "#27815f", "#9a6515", "#ac4b65", "#62748a")
"""Of stages in their order, distinguished by their numbers too; white text has 4.5:1 on each."""
TITLES = {"p50_ms": "usual", "p95_ms": "slow"}
"""Of the two bars: the median, and what one frame in twenty is slower than."""
NOTHING = "Rehearse (F5) to see how long each step takes."
MIN_LABEL_PX = 18
"""Parts narrower than this have no number in them."""


class LatencyBar(QWidget):
    """Two bars with the stages' numbers in them, and a key below.

    Args:
        nothing: what is said while there are no stages.
    """

    def __init__(self, nothing: str = NOTHING) -> None:
        super().__init__()
        self._nothing = nothing
        self._stages: tuple[StageTime, ...] = ()
        self._whole: StageTime | None = None
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Time per stage")
        self.setToolTip("usual: the median; slow: one frame in twenty takes longer")

    def show_stages(self, stages: Sequence[StageTime], whole: StageTime | None = None) -> None:
        """Show these.

        Args:
            stages: in their order.
            whole: of all together, where that was measured; None to add the stages up, of which
                not all are slow in the same frame.
        """
        is_other = len(stages) != len(self._stages)
        self._stages, self._whole = tuple(stages), whole
        if is_other:
            self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        """See Qt."""
        lines = 4 + len(self._stages)
        return QSize(260, int(lines * 1.5 * self.fontMetrics().height()) + 4)

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        painter = QPainter(self)
        line_px = 1.5 * self.fontMetrics().height()
        text = self.palette().windowText().color()
        painter.setPen(text)
        if not self._stages:
            painter.drawText(
                self.rect(),
                Qt.AlignmentFlag.AlignCenter,
                self._nothing,
            )
            return
        label_px = self.fontMetrics().horizontalAdvance("usual 000.0 ms  ")
        longest = max(sum(s.p95_ms for s in self._stages), 1e-9)
        for row, (key, name) in enumerate(TITLES.items()):
            times = [getattr(stage, key) for stage in self._stages]
            top = row * line_px
            painter.setPen(text)
            flags = Qt.AlignmentFlag.AlignVCenter
            label = QRectF(0, top, label_px, line_px)
            painter.drawText(label, flags | Qt.AlignmentFlag.AlignLeft, name)
            number = label.adjusted(0, 0, -self.fontMetrics().horizontalAdvance("  "), 0)
            total_ms = sum(times) if self._whole is None else getattr(self._whole, key)
            painter.drawText(number, flags | Qt.AlignmentFlag.AlignRight, _ms(total_ms))
            left = float(label_px)
            for place, time_ms in enumerate(times):
                width = (self.width() - label_px) * time_ms / longest
                part = QRectF(left, top + 2, width, line_px - 4)
                painter.fillRect(part, QColor(FILLS[place % len(FILLS)]))
                if width >= MIN_LABEL_PX:
                    painter.setPen(QColor("#ffffff"))
                    painter.drawText(part, Qt.AlignmentFlag.AlignCenter, str(place + 1))
                left += width
        self._draw_headings(painter, line_px)
        for place, stage in enumerate(self._stages):
            top = (3.5 + place) * line_px
            box = QRectF(0, top + 3, line_px - 6, line_px - 6)
            painter.fillRect(box, QColor(FILLS[place % len(FILLS)]))
            painter.setPen(QColor("#ffffff"))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, str(place + 1))
            painter.setPen(text)
            row = QRectF(line_px, top, self.width() - line_px, line_px)
            painter.drawText(row, Qt.AlignmentFlag.AlignVCenter, stage.name)
            flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight
            slow_px = self.fontMetrics().horizontalAdvance("slow 0000.0 ms")
            painter.drawText(row, flags, _ms(stage.p95_ms))
            painter.drawText(row.adjusted(0, 0, -slow_px, 0), flags, _ms(stage.p50_ms))

    def _draw_headings(self, painter: QPainter, line_px: float) -> None:
        row = QRectF(0, 2.5 * line_px, self.width(), line_px)
        flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight
        slow_px = self.fontMetrics().horizontalAdvance("slow 0000.0 ms")
        painter.setPen(self.palette().placeholderText().color())
        painter.drawText(row, flags, TITLES["p95_ms"])
        painter.drawText(row.adjusted(0, 0, -slow_px, 0), flags, TITLES["p50_ms"])


def _ms(time_ms: float) -> str:
    """A time that fits its column: from a second on without a tenth."""
    return f"{time_ms:.1f} ms" if time_ms < 1000 else f"{time_ms:.0f} ms"
