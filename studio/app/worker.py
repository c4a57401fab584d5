"""A thread that draws the twin for the window."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock, WallClock
from devices.streams import Slot, StreamClosedError
from scenes.cameras import Pinhole
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.state import SceneState, TrackState
from studio.app.pacing import Grade, Pacing
from studio.view.overlay import STATE_COLOURS, draw_avatar, draw_footprint
from studio.view.surface_drawing import LivePicture
from studio.view.twin import Twin


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What to draw: the state of the room and what its live surfaces show, seen from somewhere."""

    state: SceneState
    camera: Pinhole
    world_from_camera: Pose
    live: tuple[LivePicture, ...] = ()

    def is_seen_from(self, other: View) -> bool:
        """Whether both are seen from the same place through the same camera."""
        return self.camera == other.camera and np.array_equal(
            self.world_from_camera.matrix(), other.world_from_camera.matrix()
        )


class TwinPainter:
    """Draws the twin on a thread of its own; always the latest view that was asked for.

    While the viewer moves the pictures are coarse if they would otherwise be slow, see
    `studio.app.pacing`; the last one is drawn again in full.

    Args:
        scene: the scan.
        clock: says what time it is.
    """

    def __init__(self, scene: ScenePackage, clock: Clock | None = None) -> None:
        self.pictures: Slot[NDArray[np.uint8]] = Slot()
        self._twin = Twin(scene, NativeRenderer())
        self._boxes: Mapping[str, tuple[float, float, float]] = {
            item.object_id: item.box_m for item in scene.objects
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
            if shown is None:
                self._twin.make_coarse()
            shown = view

    def _paint(self, view: View) -> None:
        started_ns = self._clock.now_ns()
        grade = self._pacing.choose(started_ns)
        self.pictures.put(self._draw(view, grade))
        self._pacing.drew(grade, self._clock.now_ns() - started_ns)

    def _draw(self, view: View, grade: Grade) -> NDArray[np.uint8]:
        camera = scaled(view.camera, grade.scale)
        poses = {key: track.world_from_object for key, track in view.state.objects.items()}
        drawn = self._twin.picture(
            poses, camera, view.world_from_camera, coarse=grade.thinned, live=view.live
        )
        for key, track in view.state.objects.items():
            if track.state is not TrackState.STATIC and key in self._boxes:
                draw_footprint(
                    drawn,
                    camera,
                    view.world_from_camera,
                    track.world_from_object,
                    self._boxes[key],
                    colour=STATE_COLOURS[track.state],
                    dashed=track.state is TrackState.OCCLUDED,
                )
        for avatar in view.state.avatars.values():
            draw_avatar(drawn, camera, view.world_from_camera, avatar)
        return drawn


def scaled(camera: Pinhole, scale: float) -> Pinhole:
    """The same view in a picture `scale` times as large, in whole pixels and at least one."""
    width = max(1, round(camera.width_px * scale))
    height = max(1, round(camera.height_px * scale))
    across, down = width / camera.width_px, height / camera.height_px
    return Pinhole(
        width, height, camera.fx * across, camera.fy * down, camera.cx * across, camera.cy * down
    )
