"""One view of the twin in hand: moves its viewer by mouse and keys, and does what the tools do."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QWheelEvent,
)

from studio.app.model.measured_line import MeasuredLine
from studio.app.model.workbench import Workbench
from studio.app.viewport.by_hand.corners import surface_at
from studio.app.viewport.by_hand.dragging import Aim, Drag, GrabDrag
from studio.app.viewport.by_hand.handles import Handles, Hover, handles_of, taken
from studio.app.viewport.by_hand.items import boxes_of
from studio.app.viewport.by_hand.picking import Pick, length_m, pick, point_at
from studio.app.viewport.by_hand.tools import CORNERS_HINT, HINTS, HOLDING, InHand, Tool
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.layers import Layers
from studio.app.viewport.seen_twin import SeenTwin
from studio.app.viewport.view_overlay import BACKDROP, INK, Overlay, why_nothing

FAST, SLOW = 4.0, 0.25
WHEEL_STEP = 120.0
CLICK_PX = 4.0
"""A press that moves less than this is a click, pixels."""

FLIGHT = {
    Qt.Key.Key_W: (0, 0, 1),
    Qt.Key.Key_S: (0, 0, -1),
    Qt.Key.Key_A: (-1, 0, 0),
    Qt.Key.Key_D: (1, 0, 0),
    Qt.Key.Key_E: (0, 1, 0),
    Qt.Key.Key_Q: (0, -1, 0),
}


class TwinView(SeenTwin):
    """Left drag turns, right or middle drag pans, wheel zooms, WASD and QE fly or walk.

    Args:
        bench: what is shown.
        layers: which layers, and those that take a while to make.
        drawings: what it draws the scene with, shared with other views.
        finished: called with the places when a tool has what it needs; gives what stays in hand
            where that came to nothing.
    """

    tool_taken = Signal(object)
    """The tool that is in hand from now on."""

    def __init__(
        self,
        bench: Workbench,
        *,
        layers: Layers,
        drawings: Drawings,
        finished: Callable[[InHand], InHand | None],
    ) -> None:
        super().__init__(bench, layers, drawings)
        self.hand = InHand()
        self.hover = Hover()
        self._finished = finished
        self._press = self._last = QPointF()
        self._drag: Drag | None = None
        self._drags = 0
        self._is_ringed = False
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("view of the twin")

    # --- what is seen ----------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), BACKDROP)
        if self._image is None or self.viewer is None or self.painted is None:
            painter.setPen(INK)
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, why_nothing(self.bench))
            return
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.drawImage(QRectF(self.rect()), self._image)
        overlay = Overlay(painter, self._screen_camera(), self.viewer.world_from_camera())
        area, handles = QRectF(self.rect()), self._handles()
        overlay.items(self.bench, self._layers, area=area, hovered=self.hover.item_id)
        overlay.handles(handles, drag=self._drag, hovered=self.hover.handle)
        overlay.in_hand(self.hand)
        overlay.words(QPointF(12, self.height() - 12), self._caption(), INK)
        if self._is_ringed:
            overlay.ring(area)
        has_corners = handles.corners is not None
        hint = HINTS[self.hand.tool] or (CORNERS_HINT if has_corners else "")
        if hint:
            overlay.words(QPointF(12, 24), hint, INK)

    def _caption(self) -> str:
        assert self.viewer is not None
        assert self.painted is not None
        grade = "full" if self.painted.is_full else "coarse"
        return f"{self.viewer.mode}   {self.fps:4.0f} pictures/s   {grade}"

    # --- what can be asked of it -----------------------------------------------------------------

    def take(self, tool: Tool) -> None:
        """Take a tool in hand."""
        self.hand = InHand(tool)
        crossed = tool in (Tool.MEASURE, Tool.DRAW, Tool.SURFACE)
        self.setCursor(Qt.CursorShape.CrossCursor if crossed else Qt.CursorShape.ArrowCursor)
        self.hover = Hover()
        self.update()
        self.tool_taken.emit(tool)

    def pick_at(self, x_px: float, y_px: float) -> Pick | None:
        """Return the pick under a pixel of the widget."""
        if self.painted is None:
            return None
        x, y = self._in_picture(x_px, y_px)
        view = self.painted.view
        boxes = boxes_of(self.bench)
        found = pick(boxes, self.painted.depth, view.camera, view.world_from_camera, x, y)
        if found is None or found.item_id:
            return found
        return replace(found, item_id=surface_at(view.state.surfaces, found.point))

    def _in_picture(self, x_px: float, y_px: float) -> tuple[float, float]:
        camera = self.camera
        return (
            x_px * camera.width_px / max(self.width(), 1),
            y_px * camera.height_px / max(self.height(), 1),
        )

    def _handles(self) -> Handles:
        assert self.viewer is not None
        camera, eye = self._screen_camera(), self.viewer.world_from_camera()
        return handles_of(self.bench, self.hand.tool, camera=camera, world_from_camera=eye)

    # --- mouse and keys --------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        self._press = self._last = event.position()
        if _with_control(event) and event.button() == Qt.MouseButton.LeftButton:
            self._drag = self._grabbed(event.position())
            return
        if event.button() == Qt.MouseButton.LeftButton and self.viewer is not None:
            at_px = (event.position().x(), event.position().y())
            self._drags += 1
            merge = f"drag {id(self)} {self._drags}"
            self._drag = taken(self.bench, self._handles(), at_px=at_px, merge=merge)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        moved = event.position() - self._last
        self._last = event.position()
        if self.viewer is None:
            return
        if self._drag is not None:
            x, y = event.position().x(), event.position().y()
            eye = self.viewer.world_from_camera()
            self._drag.to(Aim(x, y, self._screen_camera(), eye))
        elif not event.buttons():
            self._hover_over(event.position())
        elif event.buttons() & Qt.MouseButton.LeftButton:
            self.set_viewer(self.viewer.dragged(moved.x(), moved.y()))
        elif event.buttons() & (Qt.MouseButton.RightButton | Qt.MouseButton.MiddleButton):
            focal = self._screen_camera().fx
            orbit = self.viewer.orbit.panned(moved.x(), moved.y(), focal_px=focal)
            self.set_viewer(replace(self.viewer, orbit=orbit))

    def _hover_over(self, at: QPointF) -> None:
        """Show what a press here would take hold of, or a click select."""
        hover = Hover()
        if self.hand.tool in HOLDING:
            hover = Hover.over(self._handles(), self.pick_at, at_px=(at.x(), at.y()))
        if hover != self.hover:
            self.hover = hover
            self.update()

    def focusInEvent(self, event: QFocusEvent) -> None:
        """See Qt: a ring says where keys go, for whoever came here by keys."""
        super().focusInEvent(event)
        reasons = (Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason)
        self._is_ringed = event.reason() in reasons
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """See Qt."""
        super().focusOutEvent(event)
        self._is_ringed = False
        self.update()

    def leaveEvent(self, event: QEvent) -> None:
        """See Qt: nothing is under the mouse any more."""
        super().leaveEvent(event)
        if self.hover != Hover():
            self.hover = Hover()
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """See Qt."""
        drag, self._drag = self._drag, None
        if drag is not None:
            drag.end()
            self.update()
            return
        away = event.position() - self._press
        if (
            math.hypot(away.x(), away.y()) < CLICK_PX
            and event.button() == Qt.MouseButton.LeftButton
        ):
            self._click(event.position())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Turn about the place from now on; while walking, go there."""
        found = self.pick_at(event.position().x(), event.position().y())
        if found is None or self.viewer is None:
            return
        if self.viewer.mode == "walk":
            self.stand_at(float(found.point[0]), float(found.point[1]))
        else:
            self.set_viewer(self.viewer.about(found.point))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """See Qt."""
        steps = event.angleDelta().y() / WHEEL_STEP
        if self.viewer is None:
            return
        if self.viewer.mode == "orbit":
            self.set_viewer(replace(self.viewer, orbit=self.viewer.orbit.zoomed(steps)))
        else:
            floor = self._floor.of(self.bench.scene)
            self.set_viewer(self.viewer.stepped(0, 0, 2 * steps, floor=floor))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """See Qt: flight, and what ends a tool."""
        key = Qt.Key(event.key())
        if self.viewer is not None and key in FLIGHT and not _with_control(event):
            fast = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
            slow = event.modifiers() & Qt.KeyboardModifier.AltModifier
            factor = FAST if fast else SLOW if slow else 1.0
            right, up, ahead = (factor * v for v in FLIGHT[key])
            floor = self._floor.of(self.bench.scene)
            self.set_viewer(self.viewer.stepped(right, up, ahead, floor=floor))
        elif key == Qt.Key.Key_Escape:
            self.take(Tool.SELECT)
        elif key == Qt.Key.Key_Backspace and self.hand.places:
            self.hand = self.hand.without_last()
            self.update()
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.hand.places:
            self._finish()
        else:
            super().keyPressEvent(event)

    def _click(self, at: QPointF) -> None:
        if self.hand.tool in HOLDING:
            found = self.pick_at(at.x(), at.y())
            self.bench.select("" if found is None else found.item_id)
            return
        if self.painted is None:
            return
        x, y = self._in_picture(at.x(), at.y())
        view = self.painted.view
        place = point_at(self.painted.depth, view.camera, view.world_from_camera, x, y)
        if place is None:
            self.bench.say("warning", "there is nothing at that place to measure or draw on")
            return
        self.hand = self.hand.picked(place)
        if self.hand.tool is Tool.MEASURE and len(self.hand.places) > 1:
            line = MeasuredLine(self.bench.document.scene, length_m(self.hand.places))
            self.bench.share(line)
        if self.hand.is_complete:
            self._finish()
        self.update()

    def _finish(self) -> None:
        hand = self.hand
        self.take(Tool.SELECT)
        left = self._finished(hand)
        if left is not None:
            self.take(left.tool)
            self.hand = left

    def _grabbed(self, at: QPointF) -> Drag | None:
        """Grip what is under the mouse, for the running physics to pull."""
        found, grabbing = self.pick_at(at.x(), at.y()), self.bench.grabbing
        if found is None or not found.item_id or grabbing is None:
            return None
        self.bench.select(found.item_id)
        is_gripped = grabbing.grab(found.item_id, found.point)
        return GrabDrag(grabbing, found.point) if is_gripped else None


def _with_control(event: QKeyEvent | QMouseEvent) -> bool:
    return bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
