"""A photo on which a box is drawn, or points are clicked; and two pictures with a slider."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

INK, RIM = QColor("#ffb02e"), QColor("#101010")
"""Of marks on photos: bright with a dark rim, seen on any picture."""
LEAST_BOX_PX = 4.0
"""A drag shorter than this is no box, picture pixels."""


class PhotoMarker(QWidget):
    """Shows a picture as large as fits; marks are in its pixels."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.draws_box = True
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
        self.box, self.points = None, []
        self.update()

    def set_marks(
        self, box: tuple[float, float, float, float] | None, points: list[tuple[float, float]]
    ) -> None:
        """Show marks that were made before."""
        self.box, self.points = box, list(points)
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
        if self.draws_box:
            self._from = event.position()
        else:
            self.points.append(self.pixel_at(event.position()))
            self.changed.emit()
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        if self._from is not None:
            (x0, y0), (x1, y1) = self.pixel_at(self._from), self.pixel_at(event.position())
            self.box = min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        if self._from is None:
            return
        self.mouseMoveEvent(event)
        self._from = None
        if self.box is not None and (
            min(self.box[2] - self.box[0], self.box[3] - self.box[1]) < LEAST_BOX_PX
        ):
            self.box = None
        self.changed.emit()
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
        """Where the line is, 0..1 from the left."""
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
