"""A thread that draws the twin for the window: splats, and meshes among them by depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock, WallClock
from devices.streams import Slot, StreamClosedError
from scenes.workers.task import Task
from studio.app.viewport.drawing.pacing import FULL, Grade, Pacing
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.view_memory import ViewMemory
from studio.app.viewport.drawing.view_picture import View, draw_view


@dataclass(frozen=True, slots=True, eq=False)
class Painted:
    """A picture for the window.

    Attributes:
        picture: (H, W, 3) RGB, of the grade's size.
        depth: (H, W) float32 metres along z of splats and meshes, 0 where nothing is.
        view: what it shows.
        grade: how finely it is drawn.
        took_ns: how long drawing it took.
    """

    picture: NDArray[np.uint8]
    depth: NDArray[np.float32]
    view: View
    grade: Grade
    took_ns: int

    @property
    def is_full(self) -> bool:
        """Whether nothing was left out of it."""
        return self.grade == FULL


class TwinPainter:
    """Draws the twin on a thread of its own; always the latest view that was asked for.

    While the viewer moves the pictures are coarse if they would otherwise be slow, see
    `studio.app.viewport.drawing.pacing`; the last one is drawn again in full.

    Args:
        drawing: of the scene, shared with other views.
        clock: says what time it is.
    """

    def __init__(self, drawing: SceneDrawing, clock: Clock | None = None) -> None:
        self.pictures: Slot[Painted] = Slot()
        self._drawing = drawing
        self._memory = ViewMemory(drawing)
        self._views: Slot[View] = Slot()
        self._clock = clock or WallClock()
        self._pacing = Pacing()
        self._task = Task("twin painter", self._run)
        self._task.start()

    def show(self, view: View) -> None:
        """Ask for a picture; an older request that was not begun is forgotten."""
        self._views.put(view)

    def stop(self) -> None:
        """Finish the picture in hand and end."""
        self._views.close()
        self._task.join()

    def _run(self, _task: Task[None]) -> None:
        shown: View | None = None
        while True:
            wait_s = self._pacing.refine_after_s(self._clock.now_ns()) if shown else None
            asked = self._views.take(timeout_s=wait_s)
            view = asked or (None if self._views.closed else shown)
            if view is None:
                return
            if shown is not None and not view.is_seen_from(shown):
                self._pacing.moved(self._clock.now_ns())
            try:
                self._paint(view)
            except StreamClosedError:
                return
            if not self._drawing.is_prepared:
                # The first picture is there; what takes long to prepare comes after it.
                self._drawing.prepare()
                if view.shapes:
                    self._paint(view)
            shown = view

    def _paint(self, view: View) -> None:
        started_ns = self._clock.now_ns()
        grade = self._pacing.choose(started_ns)
        picture, depth = draw_view(self._drawing, view, grade=grade, memory=self._memory)
        took_ns = self._clock.now_ns() - started_ns
        self.pictures.put(Painted(picture, depth, view, grade, took_ns))
        self._pacing.drew(grade, took_ns)
