"""A thread that draws the twin for the window: splats, and meshes among them by depth."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock, WallClock
from devices.streams import Slot, StreamClosedError
from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.state import SceneState, TrackState
from studio.app.viewport.drawing.composite import composite
from studio.app.viewport.drawing.pacing import FULL, Grade, Pacing
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.shapes import Shape
from studio.view.overlay import STATE_COLOURS, draw_avatar, draw_footprint, draw_line
from studio.view.surface_drawing import LivePicture


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What to draw, seen from somewhere.

    Attributes:
        state: of the room.
        camera: looked through.
        world_from_camera: from where.
        live: what live surfaces show.
        shapes: everything but splats and live pictures.
    """

    state: SceneState
    camera: Pinhole
    world_from_camera: Pose
    live: tuple[LivePicture, ...] = ()
    shapes: tuple[Shape, ...] = ()

    def is_seen_from(self, other: View) -> bool:
        """Whether both are seen from the same place through the same camera."""
        return self.camera == other.camera and np.array_equal(
            self.world_from_camera.matrix(), other.world_from_camera.matrix()
        )


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
        self._boxes: Mapping[str, tuple[float, float, float]] = {
            item.object_id: item.box_m for item in drawing.scene.objects
        }
        self._views: Slot[View] = Slot()
        self._clock = clock or WallClock()
        self._pacing = Pacing()
        self._thread = threading.Thread(target=self._run, name="twin painter", daemon=True)
        self._thread.start()

    def show(self, view: View) -> None:
        """Ask for a picture; an older request that was not begun is forgotten."""
        self._views.put(view)

    def stop(self) -> None:
        """Finish the picture in hand and end."""
        self._views.close()
        self._thread.join()

    def _run(self) -> None:
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
        picture, depth = self._draw(view, grade)
        took_ns = self._clock.now_ns() - started_ns
        self.pictures.put(Painted(picture, depth, view, grade, took_ns))
        self._pacing.drew(grade, took_ns)

    def _draw(self, view: View, grade: Grade) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        camera = scaled(view.camera, grade.scale)
        poses = {key: track.world_from_object for key, track in view.state.objects.items()}
        drawn = self._drawing.twin.drawn(
            poses,
            camera,
            view.world_from_camera,
            coarse=grade.thinned,
            live=view.live,
            opens=True,
        )
        picture, depth = drawn.picture, drawn.depth
        thread = self._drawing.meshes
        meshes = None
        if thread is not None and view.shapes:
            meshes = thread.draw(view.shapes, camera, view.world_from_camera)
        if meshes is not None:
            composite(picture, depth, meshes)
            depth = np.where((depth <= 0) | (meshes.depth < depth), meshes.depth, depth)
            depth[~np.isfinite(depth)] = 0.0
        elif view.shapes:
            self._outline(picture, replace(view, camera=camera))
        for key, track in view.state.objects.items():
            if track.state is not TrackState.STATIC and key in self._boxes:
                draw_footprint(
                    picture,
                    camera,
                    view.world_from_camera,
                    track.world_from_object,
                    self._boxes[key],
                    colour=STATE_COLOURS[track.state],
                    dashed=track.state is TrackState.OCCLUDED,
                )
        return picture, depth

    def _outline(self, picture: NDArray[np.uint8], view: View) -> None:
        """People and lines as strokes over the picture: where there is no OpenGL."""
        for avatar in view.state.avatars.values():
            draw_avatar(picture, view.camera, view.world_from_camera, avatar)
        for line in view.state.annotations.values():
            draw_line(picture, view.camera, view.world_from_camera, line)


def scaled(camera: Pinhole, scale: float) -> Pinhole:
    """The same view in a picture `scale` times as large, in whole pixels and at least one."""
    width = max(1, round(camera.width_px * scale))
    height = max(1, round(camera.height_px * scale))
    across, down = width / camera.width_px, height / camera.height_px
    return Pinhole(
        width, height, camera.fx * across, camera.fy * down, camera.cx * across, camera.cy * down
    )
