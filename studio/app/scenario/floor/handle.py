"""Handles dragged on the floor plan, with all that goes along."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QPen
from PySide6.QtWidgets import (
    QGraphicsEllipseItem,
    QGraphicsItem,
    QGraphicsPathItem,
    QGraphicsSceneMouseEvent,
)

from studio.app.scenario.colours import on

PX_PER_M = 100.0
"""Of the scene's own pixels; the view scales them to its size."""


class Handle(QGraphicsEllipseItem):
    """A disc that is dragged; what it stands for is changed once, when it is let go.

    Args:
        place: (x, y), metres.
        radius_m: of the disc.
        colour: of it.
        dropped: called with the new place.
    """

    def __init__(
        self,
        place: tuple[float, float],
        radius_m: float,
        colour: QColor,
        dropped: Callable[[float, float], object],
    ) -> None:
        size = radius_m * PX_PER_M
        super().__init__(-size, -size, 2 * size, 2 * size)
        self._dropped = dropped
        self._followers: list[QGraphicsItem] = []
        self._ways: list[QGraphicsPathItem] = []
        self.setPos(to_scene(*place))
        self._start = self.pos()
        self.setBrush(colour)
        self.setPen(QPen(on(colour), 2))
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemIsMovable)
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemIgnoresParentOpacity)
        self.setCursor(Qt.CursorShape.OpenHandCursor)
        self.setZValue(5)

    def lead(self, items: Iterable[QGraphicsItem], ways: Iterable[QGraphicsPathItem] = ()) -> None:
        """Take these along while it is dragged; ways begin where it is."""
        self._followers += items
        self._ways += ways

    def mouseMoveEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Take along what belongs to it."""
        before = self.pos()
        super().mouseMoveEvent(event)
        moved = self.pos() - before
        for item in self._followers:
            item.moveBy(moved.x(), moved.y())
        for way in self._ways:
            path = way.path()
            path.setElementPositionAt(0, self.pos().x(), self.pos().y())
            way.setPath(path)

    def mouseReleaseEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Change what it stands for."""
        super().mouseReleaseEvent(event)
        moved = self.pos() - self._start
        if abs(moved.x()) + abs(moved.y()) > 1.0:
            self._start = self.pos()
            x, y = self.pos().x() / PX_PER_M, -self.pos().y() / PX_PER_M
            self._dropped(round(x, 2), round(y, 2))


def to_scene(x: float, y: float) -> QPointF:
    """A place on the floor, metres, in the scene's pixels: north is up."""
    return QPointF(x * PX_PER_M, -y * PX_PER_M)
