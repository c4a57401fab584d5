"""Two runs of one scene beside each other: the same instant, from the same place."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Protocol

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QCloseEvent,
    QColor,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QHBoxLayout, QWidget

from scenes.bodies.crowd import Crowd
from scenes.cameras import Pinhole
from scenes.package import ScenePackage
from studio.app.model.documents.document import TwinEdits
from studio.app.shell.theme import figures
from studio.app.timeline.opening import OpenRecording
from studio.app.timeline.recorded.columns import last_at
from studio.app.viewport.drawing.painter import TwinPainter
from studio.app.viewport.drawing.scene_drawing import Drawings, SceneDrawing
from studio.app.viewport.drawing.shapes import Shown, shapes_of
from studio.app.viewport.drawing.view_picture import View
from studio.app.viewport.orbit import Orbit, home
from studio.app.viewport.view_overlay import GROUND, INK, image_of

POLL_MS = 20
MAX_WIDTH_PX = 640
"""Each picture is drawn no wider and scaled up: two of them at once are drawn on few cores."""

FIELD_OF_VIEW, ASPECT = math.radians(64.0), 16 / 9
"""Across a picture of this shape, radians; a wider one sees more at its sides."""

BACKDROP = QColor(14, 16, 20)
WHEEL_STEP = 120.0


class Called(Protocol):
    """Gives the name of an object in a scene, by its id."""

    def __call__(self, item_id: str, *, scene: ScenePackage) -> str:
        """The name."""
        ...


class RunPicture(QWidget):
    """One run at an instant; a drag turns, the wheel goes nearer, for both runs.

    Args:
        name: "A" or "B".
        turned: called with the new place to look from.
        called: what an object is called in a scene.
    """

    def __init__(self, name: str, turned: Callable[[Orbit], object], called: Called) -> None:
        super().__init__()
        self.name = name
        self.run: OpenRecording | None = None
        self.orbit: Orbit | None = None
        self.caption = ""
        self._turned, self._called = turned, called
        self._t_ns = 0
        self._scene: ScenePackage | None = None
        self._drawing: SceneDrawing | None = None
        self._image: QImage | None = None
        self._painter: TwinPainter | None = None
        self._last = QPointF()
        self._crowd = Crowd()
        self.setMinimumSize(160, 90)
        self.setAccessibleName(f"run {name}")

    def sizeHint(self) -> QSize:
        """See Qt."""
        return QSize(320, 180)

    @property
    def has_picture(self) -> bool:
        """Whether something has been drawn."""
        return self._image is not None

    def open(self, run: OpenRecording, drawing: SceneDrawing) -> None:
        """Show this run from now on."""
        self.close_run()
        self.run = run
        self.orbit = home(drawing.scene.footprint_m)
        self._scene = drawing.scene
        self._painter = TwinPainter(drawing)
        self._drawing = drawing

    def close_run(self) -> None:
        """End the thread that draws."""
        if self._painter is not None:
            self._painter.stop()
        self._painter = self._image = self.run = None

    def show_instant(self, t_ns: int) -> None:
        """Show the run at an instant; beyond its end, its end."""
        self._t_ns = t_ns
        self.redraw()

    def look_from(self, orbit: Orbit) -> None:
        """Look from somewhere else."""
        self.orbit = orbit
        self.redraw()

    def redraw(self) -> None:
        """Ask for a picture of what is now."""
        if self._painter is None or self.run is None or self.orbit is None:
            return
        state = self.run.index.state_at(self._t_ns)
        scale = min(1.0, MAX_WIDTH_PX / max(self.width(), 1))
        camera = Pinhole.from_fov(
            2 * max(8, round(0.5 * self.width() * scale)),
            2 * max(8, round(0.5 * self.height() * scale)),
            field_of_view(self.width(), self.height()),
        )
        self._crowd.furniture = None if self._drawing is None else self._drawing.furniture
        shapes = shapes_of(
            state,
            shown=Shown(),
            twin=TwinEdits(),
            world_from_rig=state.world_from_rig,
            crowd=self._crowd,
        )
        view = View(state, camera, self.orbit.world_from_camera(), shapes=tuple(shapes))
        self._painter.show(view)
        self.name_anew()

    def name_anew(self) -> None:
        """Say how far off objects are, by the names that they have now."""
        if self.run is not None and self._scene is not None:
            called = partial(self._called, scene=self._scene)
            self.caption = f"{self.name}   {error_words(self.run, self._t_ns, called)}"
            self.update()

    def take(self) -> None:
        """Show what the thread has drawn since."""
        painted = None if self._painter is None else self._painter.pictures.take()
        if painted is not None:
            self._image = image_of(painted.picture)
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        painter = QPainter(self)
        painter.fillRect(self.rect(), BACKDROP)
        if self._image is not None:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(QRectF(self.rect()), self._image)
        metrics = painter.fontMetrics()
        caption = metrics.elidedText(
            self.caption, Qt.TextElideMode.ElideRight, max(self.width() - 14, 0)
        )
        area = QRectF(0, 0, metrics.horizontalAdvance(caption) + 14, metrics.height() + 6)
        painter.fillRect(area, GROUND)
        painter.setPen(INK)
        painter.drawText(area, Qt.AlignmentFlag.AlignCenter, caption)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self.redraw()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A drag begins."""
        self._last = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn."""
        if self.orbit is not None and event.buttons() & Qt.MouseButton.LeftButton:
            moved = event.position() - self._last
            self._last = event.position()
            self._turned(self.orbit.turned(moved.x(), moved.y()))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Nearer, or farther."""
        if self.orbit is not None:
            self._turned(self.orbit.zoomed(event.angleDelta().y() / WHEEL_STEP))
            event.accept()


class Beside(QWidget):
    """Both pictures, always at the same instant and from the same place.

    Args:
        called: what an object is called in a scene.
    """

    def __init__(self, called: Called) -> None:
        super().__init__()
        self._drawings = Drawings()
        a, b = (RunPicture(name, self.look_from, called) for name in ("A", "B"))
        self.pictures = (a, b)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(2)
        for picture in self.pictures:
            row.addWidget(picture, 1)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._take)

    def open(self, runs: tuple[OpenRecording, OpenRecording], scene: ScenePackage) -> None:
        """Show two runs."""
        for picture, run in zip(self.pictures, runs, strict=True):
            picture.open(run, self._drawings.of(scene))
        self._timer.start(POLL_MS)

    def show_instant(self, t_ns: int) -> None:
        """Show both at an instant."""
        for picture in self.pictures:
            picture.show_instant(t_ns)

    def look_from(self, orbit: Orbit) -> None:
        """Look at both from somewhere."""
        for picture in self.pictures:
            picture.look_from(orbit)

    def name_anew(self) -> None:
        """Use the names that objects have now."""
        for picture in self.pictures:
            picture.name_anew()

    def close_runs(self) -> None:
        """End the threads that draw."""
        self._timer.stop()
        for picture in self.pictures:
            picture.close_run()
        self._drawings.close()

    def _take(self) -> None:
        for picture in self.pictures:
            picture.take()

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the threads that draw."""
        self.close_runs()
        event.accept()


def field_of_view(width_px: int, height_px: int) -> float:
    """Across a picture of that size, radians."""
    wider = max(1.0, width_px / max(height_px, 1) / ASPECT)
    return 2.0 * math.atan(wider * math.tan(0.5 * FIELD_OF_VIEW))


def error_words(run: OpenRecording, t_ns: int, name: Callable[[str], str]) -> str:
    """The object that is farthest off at an instant, and how far, in words.

    Args:
        run: with its errors.
        t_ns: the instant, nanoseconds of the session.
        name: what the object of an id is called.
    """
    found: list[tuple[float, str]] = []
    for object_id, curve in run.curves.items():
        at = last_at(curve.t_ns, t_ns)
        if at >= 0:
            found.append((float(curve.world_cm[at]), object_id))
    if not found:
        return "no true places are known"
    largest_cm, object_id = max(found)
    return f"off by at most {figures(largest_cm, '5.1f')} cm ({name(object_id)})"
