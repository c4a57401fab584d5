"""The window's two pictures: the twin, which can be orbited, and the camera."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.app.orbit import Orbit

BACKDROP = QColor(14, 16, 20)
CAPTION = QColor(214, 218, 224)
CAPTION_GROUND = QColor(14, 16, 20, 170)
CORNER = QColor(86, 180, 233)
CAMERA_CAPTION = "360° camera, front lens"
PICK_CAPTION = "click a flat surface's four corners, top left first · Esc to leave"
STEP_M, FAST, SLOW = 0.12, 4.0, 0.25
WHEEL_STEP = 120.0
FLIGHT = {
    Qt.Key.Key_W: (0, 0, 1),
    Qt.Key.Key_S: (0, 0, -1),
    Qt.Key.Key_A: (-1, 0, 0),
    Qt.Key.Key_D: (1, 0, 0),
    Qt.Key.Key_E: (0, 1, 0),
    Qt.Key.Key_Q: (0, -1, 0),
}


class PicturePane(QWidget):
    """Shows a picture as large as it fits, with a caption."""

    def __init__(self, caption: str) -> None:
        super().__init__()
        self._caption = caption
        self._image: QImage | None = None
        self.setMinimumSize(240, 180)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(caption)

    def sizeHint(self) -> QSize:
        """See Qt."""
        return QSize(640, 480)

    def show_picture(self, picture: NDArray[np.uint8]) -> None:
        """Take an (H, W, 3) RGB picture."""
        rgb = np.ascontiguousarray(picture)
        height, width = rgb.shape[:2]
        image = QImage(rgb.data, width, height, 3 * width, QImage.Format.Format_RGB888)
        self._image = image.copy()  # the array may go before the image does
        self.update()

    @property
    def has_picture(self) -> bool:
        """Whether anything was shown yet."""
        return self._image is not None

    def _picture_area(self, image: QImage) -> QRectF:
        """Where the picture is in the pane, as large as it fits."""
        scale = min(self.width() / image.width(), self.height() / image.height())
        width, height = scale * image.width(), scale * image.height()
        return QRectF((self.width() - width) / 2, (self.height() - height) / 2, width, height)

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), BACKDROP)
        if self._image is not None:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(self._picture_area(self._image), self._image)
        width = painter.fontMetrics().horizontalAdvance(self._caption)
        painter.fillRect(0, 0, width + 20, 28, CAPTION_GROUND)
        painter.setPen(CAPTION)
        painter.drawText(10, 19, self._caption)
        painter.end()


class CameraPane(PicturePane):
    """The camera's picture, in which corners of a surface can be clicked.

    Args:
        picked: called with (4, 2) picture pixels when the fourth corner was clicked, or with None
            when the user left off.
    """

    def __init__(self, picked: Callable[[NDArray[np.float64] | None], None]) -> None:
        super().__init__(CAMERA_CAPTION)
        self._picked = picked
        self._corners: list[tuple[float, float]] | None = None

    @property
    def picking(self) -> bool:
        """Whether clicks are taken as corners."""
        return self._corners is not None

    def pick(self, on: bool) -> None:
        """Take the next four clicks as corners, or no longer; Escape ends it too."""
        self._corners = [] if on else None
        self.setCursor(Qt.CursorShape.CrossCursor if on else Qt.CursorShape.ArrowCursor)
        self._caption = PICK_CAPTION if on else CAMERA_CAPTION
        if on:
            self.setFocus()
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        if self._corners is None or self._image is None:
            return
        area = self._picture_area(self._image)
        scale = self._image.width() / area.width()
        at = (event.position() - area.topLeft()) * scale
        if not (0 <= at.x() <= self._image.width() and 0 <= at.y() <= self._image.height()):
            return
        self._corners.append((at.x(), at.y()))
        self.update()
        if len(self._corners) == 4:
            corners = np.array(self._corners)
            self.pick(False)
            self._picked(corners)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """See Qt."""
        if self.picking and event.key() == Qt.Key.Key_Escape:
            self.pick(False)
            self._picked(None)
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        super().paintEvent(event)
        if not self._corners or self._image is None:
            return
        area = self._picture_area(self._image)
        scale = area.width() / self._image.width()
        points = [area.topLeft() + QPointF(x, y) * scale for x, y in self._corners]
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(CORNER, 2))
        painter.drawPolyline(points)
        for point in points:
            painter.drawEllipse(point, 5.0, 5.0)
        painter.end()


class TwinPane(PicturePane):
    """The twin: left drag turns, right or middle drag pans, wheel zooms, WASD and QE fly, F frames.

    Args:
        changed: called when another picture is wanted.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        super().__init__("twin · drag to turn, wheel to zoom, WASD to fly, F to see all")
        self.orbit: Orbit | None = None
        self._home: Orbit | None = None
        self._changed = changed
        self._last = QPointF()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def look_from(self, home: Orbit) -> None:
        """Start at this view; F comes back to it."""
        self._home = home
        self._set(home)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        self._last = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        moved = event.position() - self._last
        self._last = event.position()
        if self.orbit is None:
            return
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._set(self.orbit.turned(moved.x(), moved.y()))
        elif event.buttons() & (Qt.MouseButton.RightButton | Qt.MouseButton.MiddleButton):
            self._set(self.orbit.panned(moved.x(), moved.y(), focal_px=0.8 * self.width()))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """See Qt."""
        if self.orbit is not None:
            self._set(self.orbit.zoomed(event.angleDelta().y() / WHEEL_STEP))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """See Qt."""
        key = Qt.Key(event.key())
        if self.orbit is not None and key in FLIGHT:
            fast = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
            slow = event.modifiers() & Qt.KeyboardModifier.AltModifier
            step = STEP_M * (FAST if fast else SLOW if slow else 1.0)
            right, up, forward = (step * v for v in FLIGHT[key])
            self._set(self.orbit.flown(right, up, forward))
        elif self._home is not None and key == Qt.Key.Key_F:
            self._set(self._home)
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self._changed()

    def _set(self, orbit: Orbit) -> None:
        self.orbit = orbit
        self._changed()
