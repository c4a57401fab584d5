"""One view of the twin: shows its pictures, moves its viewer, and does what the tools do."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import (
    QCloseEvent,
    QFocusEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from scenes.cameras import Pinhole
from studio.app.model.measured_line import MeasuredLine
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.by_hand.corners import surface_at
from studio.app.viewport.by_hand.dragging import Aim, Drag, GrabDrag
from studio.app.viewport.by_hand.handles import Handles, Hover, handles_of, taken
from studio.app.viewport.by_hand.items import boxes_of
from studio.app.viewport.by_hand.picking import Pick, length_m, pick, point_at
from studio.app.viewport.by_hand.tools import CORNERS_HINT, HINTS, HOLDING, InHand, Tool
from studio.app.viewport.drawing.painter import Painted, TwinPainter
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.drawing.shapes import shapes_of
from studio.app.viewport.drawing.view_picture import View
from studio.app.viewport.layers import Layers
from studio.app.viewport.orbit import home
from studio.app.viewport.view_overlay import BACKDROP, INK, Overlay, image_of, why_nothing
from studio.app.viewport.viewer import MODES, Mode, Viewer
from studio.app.viewport.walk import FoundFloor, Walker

POLL_MS = 10
MAX_WIDTH_PX = 960
"""The twin is drawn no wider than this and scaled up: two processor cores draw it live."""

FIELD_OF_VIEW = math.radians(64.0)
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


class TwinView(QWidget):
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
        super().__init__()
        self.bench = bench
        self._layers = layers
        self._drawings = drawings
        self.viewer: Viewer | None = None
        self.hand = InHand()
        self.painted: Painted | None = None
        self.fps = 0.0
        self._floor = FoundFloor()
        self._finished = finished
        self._image: QImage | None = None
        self._painter: TwinPainter | None = None
        self._home: Viewer | None = None
        self._room: tuple[str, bytes] | None = None
        self._press = self._last = QPointF()
        self._drag: Drag | None = None
        self._drags = 0
        self._is_covered = False
        self._is_ringed = False
        self.hover = Hover()
        self.setMouseTracking(True)
        self.setMinimumSize(240, 160)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("view of the twin")
        for topic in (Topic.STATE, Topic.SETTINGS):
            bench.listen(topic, self.redraw)
        bench.listen(Topic.SELECTION, self.update)
        bench.listen(Topic.SCENE, self._new_scene)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._poll)
        self._timer.start(POLL_MS)
        self._new_scene()

    # --- what is seen ----------------------------------------------------------------------------

    def _new_scene(self) -> None:
        if self._painter is not None:
            self._painter.stop()
            self._painter = None
        scene = self.bench.scene
        self._image = self.painted = None
        if scene is not None:
            orbit = home(scene.footprint_m)
            x, y, _ = orbit.target
            self._home = Viewer(orbit, Walker(x, y, 0.0))
            # A session or a recording in the same room is seen from where one stands.
            room = (scene.name, scene.footprint_m.tobytes())
            if room != self._room or self.viewer is None:
                self.viewer = self._home
            self._room = room
            if self.viewer.mode == "walk":
                self._floor.find(scene)
            self._painter = TwinPainter(self._drawings.of(scene))
            self.redraw()
        self.update()

    @property
    def camera(self) -> Pinhole:
        """Camera that the view is drawn through: even sizes, so that half of it shows the same."""
        scale = min(1.0, MAX_WIDTH_PX / max(self.width(), 1))
        width = 2 * max(8, round(0.5 * self.width() * scale))
        height = 2 * max(8, round(0.5 * self.height() * scale))
        return Pinhole.from_fov(width, height, FIELD_OF_VIEW)

    def cover(self, is_covered: bool) -> None:
        """Neither shown nor drawn while something else has its place."""
        if is_covered != self._is_covered:
            self._is_covered = is_covered
            self.setVisible(not is_covered)
            self.redraw()

    def redraw(self) -> None:
        """Ask for a picture of what is now."""
        if self._painter is None or self.viewer is None or self._is_covered:
            return
        bench, scene = self.bench, self.bench.scene
        rig = bench.state.world_from_rig or (scene.world_from_rig if scene else None)
        shapes = shapes_of(
            bench.state,
            shown=self._layers.shown,
            twin=bench.document.twin,
            world_from_rig=rig,
        )
        shapes += self._layers.shapes()
        pose = self.viewer.world_from_camera()
        self._painter.show(View(bench.state, self.camera, pose, bench.live, tuple(shapes)))
        self.update()

    def _poll(self) -> None:
        if self._painter is None:
            return
        painted = self._painter.pictures.take()
        if painted is not None:
            self.painted = painted
            self.fps += 0.2 * (1e9 / max(painted.took_ns, 1) - self.fps)
            self._image = image_of(painted.picture)
            self.update()

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

    def _screen_camera(self) -> Pinhole:
        return Pinhole.from_fov(max(self.width(), 2), max(self.height(), 2), FIELD_OF_VIEW)

    def picture(self) -> QImage:
        """The view as it is shown, without the window around it."""
        return self.grab().toImage()

    # --- what can be asked of it -----------------------------------------------------------------

    def set_viewer(self, viewer: Viewer) -> None:
        """See from there."""
        self.viewer = viewer
        self.redraw()

    def go_home(self) -> None:
        """See the whole room."""
        if self._home is not None:
            self.set_viewer(self._home)

    def set_mode(self, mode: str) -> None:
        """Move in another way.

        Raises:
            ValueError: there is no such way.
        """
        if mode not in MODES:
            raise ValueError(f"mode = {mode!r}, wanted one of {', '.join(MODES)}")
        chosen: Mode = next(m for m in MODES if m == mode)
        if chosen == "walk":
            self._floor.find(self.bench.scene)
        if self.viewer is not None:
            self.set_viewer(self.viewer.in_mode(chosen, self._floor.of(self.bench.scene)))

    def frame(self) -> None:
        """Come near to what is selected, or see the whole room."""
        boxes = boxes_of(self.bench)
        if self.viewer is None or self.bench.selection not in boxes:
            self.go_home()
            return
        pose, size = boxes[self.bench.selection]
        centre = pose @ np.array([0.0, 0.0, 0.5 * size[2]])
        self.set_viewer(self.viewer.framed(centre, 0.5 * float(np.linalg.norm(size))))

    def stand_at(self, x: float, y: float) -> None:
        """Walk from there on."""
        if self.viewer is None:
            return
        self.set_mode("walk")
        floor = self._floor.of(self.bench.scene)
        walker = self.viewer.walker.stood_at(np.array([x, y]), floor)
        self.set_viewer(replace(self.viewer, walker=walker))

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

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self.redraw()

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the thread that draws."""
        self._timer.stop()
        for callback in (self.redraw, self.update, self._new_scene):
            self.bench.stop_listening(callback)
        if self._painter is not None:
            self._painter.stop()
            self._painter = None
        event.accept()

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
