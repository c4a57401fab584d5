"""A photo on which a box is drawn, or points are clicked; and two pictures with a slider."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from scenes.prepare.cutout.marks.drawn import Point, Stroke

INK, RIM = QColor("#ffb02e"), QColor("#101010")
"""Of marks on photos: bright with a dark rim, seen on any picture."""
WASH = QColor(255, 176, 46, 90)
"""Over what the brush and the lasso mean."""
MIN_BOX_PX = 4.0
"""A drag shorter than this is no box, picture pixels."""


class MarkTool(StrEnum):
    """Shapes that the mouse draws on a photo."""

    BOX = "Box"
    LASSO = "Lasso"
    BRUSH = "Brush"
    CLICKS = "Clicks"


BRUSHES_PX = (2.0, 120.0)
"""Smallest and largest radius of the brush, picture pixels."""
BRUSH_STEP = 1.25
"""Factor of the radius per notch of the wheel."""
APART_PX = 2.0
"""Points of an outline or stroke nearer than that to the last one are left out, picture pixels."""


class PhotoMarker(QWidget):
    """Shows a picture as large as fits; marks are in its pixels. The wheel sizes the brush."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.tool = MarkTool.BOX
        self.radius_px = 12.0
        """Of the brush, picture pixels."""
        self.outlines: list[tuple[Point, ...]] = []
        self.strokes: list[Stroke] = []
        self._line: list[Point] = []
        """Of the lasso or the brush, while it is drawn."""
        self._at: QPointF | None = None
        self.setMouseTracking(True)
        self.box: tuple[float, float, float, float] | None = None
        self.points: list[tuple[float, float]] = []
        self.hint = "no photo"
        self._image = QImage()
        self._from: QPointF | None = None
        self.setMinimumHeight(110)
        self.setCursor(Qt.CursorShape.CrossCursor)

    def show_image(self, image: QImage) -> None:
        """Show a picture without marks."""
        self._image = image
        self.clear()

    def clear(self) -> None:
        """Take all marks away."""
        self.set_marks(None, ())

    def set_marks(
        self,
        box: tuple[float, float, float, float] | None,
        points: Sequence[Point],
        outlines: Sequence[tuple[Point, ...]] = (),
        strokes: Sequence[Stroke] = (),
    ) -> None:
        """Show marks that were made before."""
        self.box, self.points = box, list(points)
        self.outlines, self.strokes = list(outlines), list(strokes)
        self.update()

    def pixel_at(self, place: QPointF) -> tuple[float, float]:
        """The picture's pixel at a place of the widget, kept within the picture."""
        area, image = self._area(), self._image
        x = (place.x() - area.left()) / max(area.width(), 1.0) * image.width()
        y = (place.y() - area.top()) / max(area.height(), 1.0) * image.height()
        return min(max(x, 0.0), image.width()), min(max(y, 0.0), image.height())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        if self._image.isNull():
            return
        if self.tool is MarkTool.BOX:
            self._from = event.position()
        elif self.tool is not MarkTool.CLICKS:
            self._line = [self.pixel_at(event.position())]
        else:
            self.points.append(self.pixel_at(event.position()))
            self.changed.emit()
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        self._at = event.position()
        if self._line:
            point, last = self.pixel_at(event.position()), self._line[-1]
            if math.dist(point, last) >= APART_PX:
                self._line.append(point)
        if self.tool is MarkTool.BRUSH or self._line:
            self.update()
        if self._from is not None:
            (x0, y0), (x1, y1) = self.pixel_at(self._from), self.pixel_at(event.position())
            self.box = min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        if self._line:
            line, self._line = tuple(self._line), []
            if self.tool is MarkTool.BRUSH:
                self.strokes.append(Stroke(self.radius_px, line))
            elif len(line) > 2:
                self.outlines.append(line)
            self.changed.emit()
            self.update()
        if self._from is None:
            return
        self.mouseMoveEvent(event)
        self._from = None
        if self.box is not None and (
            min(self.box[2] - self.box[0], self.box[3] - self.box[1]) < MIN_BOX_PX
        ):
            self.box = None
        self.changed.emit()
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """See Qt: the brush becomes larger or smaller."""
        if self.tool is not MarkTool.BRUSH:
            event.ignore()
            return
        factor = BRUSH_STEP ** (event.angleDelta().y() / 120.0)
        least, most = BRUSHES_PX
        self.radius_px = min(max(self.radius_px * factor, least), most)
        self.update()

    def leaveEvent(self, event: QEvent) -> None:
        """See Qt."""
        super().leaveEvent(event)
        self._at = None
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        painter = QPainter(self)
        if self._image.isNull():
            painter.setPen(self.palette().placeholderText().color())
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(self.rect(), flags, self.hint)
            return
        area = self._area()
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(area, self._image)
        scale = area.width() / self._image.width()
        for colour, width in ((RIM, 4), (INK, 2)):
            painter.setPen(QPen(colour, width))
            if self.box is not None:
                x0, y0, x1, y1 = (value * scale for value in self.box)
                painter.drawRect(QRectF(x0, y0, x1 - x0, y1 - y0).translated(area.topLeft()))
            for x, y in self.points:
                painter.drawEllipse(area.topLeft() + QPointF(x, y) * scale, 4, 4)
        self._paint_drawn(painter, area.topLeft(), scale)

    def _paint_drawn(self, painter: QPainter, corner: QPointF, scale: float) -> None:
        """Outlines filled, strokes as wide as they are, and the brush where the mouse is."""

        def on_screen(line: Sequence[Point]) -> QPolygonF:
            return QPolygonF([corner + QPointF(x, y) * scale for x, y in line])

        is_brush = self.tool is MarkTool.BRUSH
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        strokes = [*self.strokes]
        if self._line and is_brush:
            strokes.append(Stroke(self.radius_px, tuple(self._line)))
        for stroke in strokes:
            pen = QPen(WASH, 2 * stroke.radius_px * scale)
            pen.setCapStyle(Qt.PenCapStyle.RoundCap)
            pen.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
            painter.setPen(pen)
            line = on_screen(stroke.points)
            if line.count() == 1:
                painter.drawPoint(line.first())
            else:
                painter.drawPolyline(line)
        outlines = [*self.outlines, *([tuple(self._line)] if self._line and not is_brush else [])]
        for colour, width in ((RIM, 4), (INK, 2)):
            painter.setPen(QPen(colour, width))
            painter.setBrush(WASH if colour is INK else Qt.BrushStyle.NoBrush)
            for outline in outlines:
                painter.drawPolygon(on_screen(outline))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if is_brush and self._at is not None:
            painter.setPen(QPen(INK, 1.5))
            painter.drawEllipse(self._at, self.radius_px * scale, self.radius_px * scale)

    def _area(self) -> QRectF:
        return fitted(self._image, QRectF(self.rect()))


class BeforeAfter(QWidget):
    """Two pictures in one place: left of the line before, right of it after."""

    def __init__(self) -> None:
        super().__init__()
        self._before, self._after = QImage(), QImage()
        self.share = 0.5
        self.setMinimumHeight(90)

    def show_images(self, before: QImage, after: QImage) -> None:
        """Show these two, of one size."""
        self._before, self._after = before, after
        self.update()

    def set_share(self, share: float) -> None:
        """Set the line's place, 0..1 from the left."""
        self.share = min(max(share, 0.0), 1.0)
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        area = fitted(self._before, QRectF(self.rect()))
        self.set_share((event.position().x() - area.left()) / max(area.width(), 1.0))

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        painter = QPainter(self)
        if self._before.isNull():
            painter.setPen(self.palette().placeholderText().color())
            words = "before and after a cut are compared here"
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, words)
            return
        area = fitted(self._before, QRectF(self.rect()))
        line = area.left() + self.share * area.width()
        painter.drawImage(area, self._after)
        painter.setClipRect(QRectF(area.left(), area.top(), line - area.left(), area.height()))
        painter.drawImage(area, self._before)
        painter.setClipping(False)
        for colour, width in ((RIM, 4), (INK, 2)):
            painter.setPen(QPen(colour, width))
            painter.drawLine(QPointF(line, area.top()), QPointF(line, area.bottom()))


def fitted(image: QImage, space: QRectF) -> QRectF:
    """The largest rectangle of a picture's shape in the middle of a space."""
    if image.isNull():
        return space
    scale = min(space.width() / image.width(), space.height() / image.height())
    area = QRectF(0, 0, image.width() * scale, image.height() * scale)
    area.moveCenter(space.center())
    return area
