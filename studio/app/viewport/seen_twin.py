"""The twin as one view sees it: drawn on a thread, anew whenever room or viewer have changed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtGui import (
    QCloseEvent,
    QImage,
    QResizeEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from scenes.cameras import Pinhole
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.by_hand.items import boxes_of
from studio.app.viewport.drawing.painter import Painted, TwinPainter
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.drawing.shapes import shapes_of
from studio.app.viewport.drawing.view_picture import View
from studio.app.viewport.layers import Layers
from studio.app.viewport.orbit import home
from studio.app.viewport.view_overlay import image_of
from studio.app.viewport.viewer import MODES, Mode, Viewer
from studio.app.viewport.walk import FoundFloor, Walker

POLL_MS = 10
MAX_WIDTH_PX = 960
"""The twin is drawn no wider than this and scaled up: two processor cores draw it live."""

FIELD_OF_VIEW = math.radians(64.0)


class SeenTwin(QWidget):
    """Pictures of the twin from a viewer that can be moved.

    Args:
        bench: what is shown.
        layers: which layers, and those that take a while to make.
        drawings: what it draws the scene with, shared with other views.
    """

    def __init__(self, bench: Workbench, layers: Layers, drawings: Drawings) -> None:
        super().__init__()
        self.bench = bench
        self._layers = layers
        self._drawings = drawings
        self.viewer: Viewer | None = None
        self.followed = ""
        """Id of the person whose eyes are looked through while they are here; "" for nobody."""
        self.painted: Painted | None = None
        self._asked: View | None = None
        self.fps = 0.0
        self._floor = FoundFloor()
        self._image: QImage | None = None
        self._painter: TwinPainter | None = None
        self._home: Viewer | None = None
        self._room: tuple[str, bytes] | None = None
        self._is_covered = False
        self.setMinimumSize(240, 160)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
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
            seen_by=self.followed,
            crowd=self._drawings.crowd,
        )
        shapes += self._layers.shapes()
        person = bench.state.avatars.get(self.followed)
        pose = self.viewer.world_from_camera() if person is None else person.world_from_head
        self._asked = View(
            bench.state, self.camera, pose, bench.live, tuple(shapes), seen_by=self.followed
        )
        self._painter.show(self._asked)
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

    def _screen_camera(self) -> Pinhole:
        return Pinhole.from_fov(max(self.width(), 2), max(self.height(), 2), FIELD_OF_VIEW)

    @property
    def is_drawn(self) -> bool:
        """Whether what is now is shown, with nothing left out of it."""
        painted = self.painted
        return painted is not None and painted.is_full and painted.view is self._asked

    def picture(self) -> QImage:
        """The view as it is shown, without the window around it."""
        return self.grab().toImage()

    # --- what can be asked of it -----------------------------------------------------------------

    def set_viewer(self, viewer: Viewer) -> None:
        """See from there, and no longer through somebody's eyes."""
        self.viewer, self.followed = viewer, ""
        self.redraw()

    def follow(self, user_id: str) -> None:
        """See what somebody sees, for as long as they are here; "" ends it."""
        self.followed = user_id
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
