"""The painted timeline: ruler, markers, faults, a row of states an object, playhead."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence

import numpy as np
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFontMetricsF,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QPolygonF,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from scenes.state import TrackState
from studio.app.model.documents.document import Marker
from studio.app.scenario.fields import fault_title
from studio.app.shell.theme import Theme
from studio.app.timeline.curves import GUTTER_PX, curve_pen
from studio.app.timeline.opening import OpenRecording
from studio.app.timeline.recorded.spans import StateSpan

RULER_PX, ROW_PX, PAD_PX = 20, 17, 3
SAMPLE_PX = 16
"""Length of the piece of an object's curve that stands before its name."""

MIN_SPAN_NS = 200_000_000
"""Shortest part that can be zoomed to: two frames of a slow camera."""

TICKS_S = (0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600)
TICK_PX = 80
"""Least distance of two numbers on the ruler."""

PATTERNS = {
    TrackState.STATIC: Qt.BrushStyle.Dense6Pattern,
    TrackState.TRACKED: Qt.BrushStyle.SolidPattern,
    TrackState.OCCLUDED: Qt.BrushStyle.BDiagPattern,
    TrackState.LOST: Qt.BrushStyle.DiagCrossPattern,
}
"""A state's pattern, beside its colour."""


def colour_of(theme: Theme, state: TrackState) -> str:
    """A state's colour."""
    return {
        TrackState.STATIC: theme.calm,
        TrackState.TRACKED: theme.good,
        TrackState.OCCLUDED: theme.warning,
        TrackState.LOST: theme.bad,
    }[state]


class TrackView(QWidget):
    """States, faults and events of a recording over time; drags and wheel call back.

    Args:
        theme: gives the colours.
        scrub: takes the time of a drag, and whether it has ended.
        hover: takes the time under the mouse and the object of that row, or None and "".
        zoomed: is called when another part is shown.
        choose: takes the id of an object whose row was clicked.
        name: gives what an object of an id is called.
    """

    def __init__(
        self,
        theme: Callable[[], Theme],
        *,
        scrub: Callable[[int, bool], None],
        hover: Callable[[int | None, str], None],
        zoomed: Callable[[], None],
        choose: Callable[[str], None],
        name: Callable[[str], str],
    ) -> None:
        super().__init__()
        self._theme, self._scrub, self._hover = theme, scrub, hover
        self._zoomed, self._choose, self._name = zoomed, choose, name
        self._shown: OpenRecording | None = None
        self._markers: Sequence[Marker] = ()
        self._playhead_ns = 0
        self.from_ns, self.to_ns = 0, 1
        self._picture: QPixmap | None = None
        self.setMouseTracking(True)
        self.setAccessibleName("Timeline of the recording")

    def show_recording(self, shown: OpenRecording | None) -> None:
        """Show a recording from end to end; None shows nothing."""
        self._shown = shown
        if shown is not None:
            self.from_ns = shown.index.start_ns
            self.to_ns = max(shown.index.end_ns, self.from_ns + MIN_SPAN_NS)
        rows = 0 if shown is None else len(shown.states)
        self.setMinimumHeight(RULER_PX + (self._heads + rows) * ROW_PX + 4)
        self.redraw()

    @property
    def _heads(self) -> int:
        """Rows above the objects': events, and faults if there are any."""
        return 2 if self._shown is not None and self._shown.faults else 1

    def show_markers(self, markers: Sequence[Marker]) -> None:
        """The document's markers."""
        self._markers = markers
        self.redraw()

    def set_playhead(self, t_ns: int) -> None:
        """Move the playhead, and bring it into view."""
        self._playhead_ns = t_ns
        if not self.from_ns <= t_ns <= self.to_ns:
            self._show_span(t_ns - (self.to_ns - self.from_ns) // 10, self.to_ns - self.from_ns)
        self.update()

    def redraw(self) -> None:
        """Draw all of it anew: another size, theme, part or content."""
        self._picture = None
        self.update()

    def x_of(self, t_ns: int) -> float:
        """Pixel of a time."""
        share = (t_ns - self.from_ns) / (self.to_ns - self.from_ns)
        return GUTTER_PX + share * max(self.width() - GUTTER_PX, 1)

    def t_at(self, x: float) -> int:
        """Time at a pixel."""
        share = (x - GUTTER_PX) / max(self.width() - GUTTER_PX, 1)
        return round(self.from_ns + share * (self.to_ns - self.from_ns))

    def zoom(self, factor: float, at_ns: int) -> None:
        """Show `factor` times as much; the time `at_ns` stays where it is."""
        if self._shown is None:
            return
        old = self.to_ns - self.from_ns
        whole = max(self._shown.index.end_ns - self._shown.index.start_ns, MIN_SPAN_NS)
        new = int(min(max(old * factor, MIN_SPAN_NS), whole))
        self._show_span(round(at_ns - (at_ns - self.from_ns) * new / old), new)

    def _show_span(self, from_ns: int, length_ns: int) -> None:
        if self._shown is None:
            return
        start = self._shown.index.start_ns
        end = max(self._shown.index.end_ns, start + MIN_SPAN_NS)
        self.from_ns = min(max(from_ns, start), max(end - length_ns, start))
        self.to_ns = self.from_ns + length_ns
        self.redraw()
        self._zoomed()

    # --- drawing ---------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        if self._picture is None:
            ratio = self.devicePixelRatioF()
            self._picture = QPixmap(self.size() * ratio)
            self._picture.setDevicePixelRatio(ratio)
            self._picture.fill(QColor(self._theme().panel))
            painter = QPainter(self._picture)
            painter.setFont(self.font())
            self._draw(painter)
            painter.end()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._picture)
        if self._shown is not None:
            x = self.x_of(self._playhead_ns)
            painter.setPen(QPen(QColor(self._theme().accent), 2))
            painter.drawLine(round(x), 0, round(x), self.height())
            painter.setBrush(QColor(self._theme().accent))
            painter.drawPolygon(_triangle(x, 0.0, 6.0, down=True))

    def _draw(self, painter: QPainter) -> None:
        if self._shown is None:
            return
        theme = self._theme()
        painter.setPen(QColor(theme.faint))
        for row, name in enumerate(("Time", "Events", "Faults")[: 1 + self._heads]):
            top = 0 if row == 0 else RULER_PX + (row - 1) * ROW_PX
            painter.drawText(8, top, GUTTER_PX - 12, ROW_PX, Qt.AlignmentFlag.AlignVCenter, name)
        self._draw_ruler(painter, theme)
        self._draw_events(painter, theme)
        self._draw_faults(painter, theme)
        for number, (object_id, spans) in enumerate(self._shown.states.items()):
            top = RULER_PX + (self._heads + number) * ROW_PX
            left = 8
            curves = list(self._shown.curves)
            if object_id in curves:
                painter.setPen(curve_pen(theme, curves.index(object_id)))
                middle = top + ROW_PX // 2
                painter.drawLine(left, middle, left + SAMPLE_PX, middle)
                left += SAMPLE_PX + 6
            painter.setPen(QColor(theme.text))
            name = QFontMetricsF(painter.font()).elidedText(
                self._name(object_id), Qt.TextElideMode.ElideRight, GUTTER_PX - left - 6
            )
            painter.drawText(left, top, GUTTER_PX, ROW_PX, Qt.AlignmentFlag.AlignVCenter, name)
            self._draw_states(painter, theme, spans, top)

    def _draw_ruler(self, painter: QPainter, theme: Theme) -> None:
        width_s = (self.to_ns - self.from_ns) / 1e9
        most = max((self.width() - GUTTER_PX) / TICK_PX, 1.0)
        step_s = next((step for step in TICKS_S if width_s / step <= most), TICKS_S[-1])
        origin_ns = 0 if self._shown is None else self._shown.index.origin_ns
        from_s, to_s = ((t_ns - origin_ns) / 1e9 for t_ns in (self.from_ns, self.to_ns))
        for t_s in np.arange(np.ceil(from_s / step_s) * step_s, to_s, step_s):
            x = round(self.x_of(origin_ns + round(t_s * 1e9)))
            painter.setPen(QColor(theme.line))
            painter.drawLine(x, RULER_PX - 6, x, self.height())
            painter.setPen(QColor(theme.faint))
            decimals = 1 if step_s < 1 else 0
            painter.drawText(x + 4, RULER_PX - 5, f"{t_s:.{decimals}f} s")

    def _draw_events(self, painter: QPainter, theme: Theme) -> None:
        assert self._shown is not None
        middle = RULER_PX + ROW_PX / 2
        painter.setPen(QPen(QColor(theme.text), 1))
        seen = -1
        for event in self._shown.index.events:
            x = round(self.x_of(event.t_ns))
            if self.from_ns <= event.t_ns <= self.to_ns and x > seen:
                painter.drawLine(x, RULER_PX + 4, x, RULER_PX + ROW_PX - 4)
                seen = x + 1
        painter.setBrush(QColor(theme.accent))
        painter.setPen(Qt.PenStyle.NoPen)
        for marker in self._markers:
            if self.from_ns <= marker.t_ns <= self.to_ns:
                painter.drawPolygon(_triangle(self.x_of(marker.t_ns), middle - 5, 6.0, down=True))
        failure = self._shown.failure
        if failure is not None and self.from_ns <= failure.t_ns <= self.to_ns:
            painter.setPen(QColor(theme.bad))
            painter.drawText(round(self.x_of(failure.t_ns)) + 3, round(middle + 5), "✖")

    def _draw_faults(self, painter: QPainter, theme: Theme) -> None:
        assert self._shown is not None
        top = RULER_PX + ROW_PX  # below the events
        painter.setPen(QColor(theme.warning))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        free_x = 0.0
        for span in self._shown.faults:
            if span.to_ns < self.from_ns or span.from_ns > self.to_ns:
                continue
            box = self._box(span.from_ns, span.to_ns, top)
            painter.fillRect(box, QBrush(QColor(theme.warning), Qt.BrushStyle.HorPattern))
            painter.drawRect(box)
            title = fault_title(span.name)
            width = QFontMetricsF(painter.font()).horizontalAdvance(title) + 8
            if box.left() >= free_x and width <= box.width():
                label = QRectF(box.left() + 2, box.top(), width, box.height())
                painter.fillRect(label, QColor(theme.panel))
                painter.drawText(label, Qt.AlignmentFlag.AlignCenter, title)
                free_x = label.right()

    def _draw_states(
        self, painter: QPainter, theme: Theme, spans: Sequence[StateSpan], top: int
    ) -> None:
        first = max(bisect_left(spans, self.from_ns, key=lambda span: span.to_ns), 0)
        for span in spans[first:]:
            if span.from_ns > self.to_ns:
                break
            colour = QColor(colour_of(theme, span.state))
            box = self._box(span.from_ns, span.to_ns, top)
            painter.fillRect(box, QBrush(colour, PATTERNS[span.state]))
            if span.state is not TrackState.STATIC and box.width() > 3:
                painter.setPen(colour)
                painter.drawRect(box)

    def _box(self, from_ns: int, to_ns: int, top: int) -> QRectF:
        left = max(self.x_of(from_ns), float(GUTTER_PX))
        right = max(min(self.x_of(to_ns), float(self.width())), left + 1)
        return QRectF(left, top + PAD_PX, right - left, ROW_PX - 2 * PAD_PX)

    # --- mouse -----------------------------------------------------------------------------------

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        self.redraw()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Go there; a name selects its object."""
        if self._shown is None or event.button() != Qt.MouseButton.LeftButton:
            return
        if event.position().x() < GUTTER_PX:
            self._choose(self._row_at(event.position().y()))
        else:
            self._scrub(self.t_at(event.position().x()), False)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Read out; drag the playhead."""
        if self._shown is None:
            return
        t_ns = self.t_at(max(event.position().x(), GUTTER_PX))
        self._hover(t_ns, self._row_at(event.position().y()))
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._scrub(t_ns, False)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """A drag ends."""
        if self._shown is not None and event.position().x() >= GUTTER_PX:
            self._scrub(self.t_at(event.position().x()), True)

    def leaveEvent(self, event: object) -> None:
        """Nothing is read out any more."""
        self._hover(None, "")

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the mouse; with Shift, move along."""
        turns = (event.angleDelta().y() or event.angleDelta().x()) / 120.0
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            length = self.to_ns - self.from_ns
            self._show_span(self.from_ns - round(turns * length / 8), length)
        else:
            self.zoom(0.8**turns, self.t_at(max(event.position().x(), GUTTER_PX)))
        event.accept()

    def _row_at(self, y: float) -> str:
        names = [] if self._shown is None else list(self._shown.states)
        number = int((y - RULER_PX) // ROW_PX) - self._heads
        return names[number] if 0 <= number < len(names) else ""


def _triangle(x: float, top: float, size: float, *, down: bool) -> QPolygonF:
    from PySide6.QtCore import QPointF

    tip, base = (top + size, top) if down else (top, top + size)
    return QPolygonF([QPointF(x - size, base), QPointF(x + size, base), QPointF(x, tip)])
