"""The window's two helpers: a thread that plays the session and one that draws the twin."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock, WallClock
from devices.streams import Slot, StreamClosedError
from scenes.cameras import Pinhole
from scenes.opening import open_scene
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.state import SceneState, TrackState
from studio.app.pacing import Grade, Pacing
from studio.console.progress import Progress
from studio.rehearsal import Performance, perform
from studio.session.session import Session, SessionOutput, SessionPlan, open_session
from studio.view.overlay import STATE_COLOURS, draw_avatar, draw_footprint
from studio.view.surface_drawing import LivePicture
from studio.view.twin import Twin

Watch = Callable[[SessionOutput], None]


class SceneJob:
    """Opens a scene, and plays a session in it if a plan is given, on a thread of its own.

    The window polls; nothing here touches a widget.

    Args:
        scene: name or path.
        plan: what to play, or None to look at the scene only.
        out: folder for the results; None plays without leaving any.
        watch: sees every result on the job's thread.
    """

    def __init__(
        self,
        scene: str,
        plan: SessionPlan | None = None,
        out: Path | None = None,
        watch: Watch | None = None,
    ) -> None:
        self.outputs: Slot[SessionOutput] = Slot()
        self.lines: Slot[str] = Slot()
        self.opened: ScenePackage | None = None
        self.session: Session | None = None
        self.performance: Performance | None = None
        self.failure: BaseException | None = None
        self._plan, self._out, self._watch = plan, out, watch
        self._scene = scene
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self._run, name="session", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether it is still at work."""
        return self._thread.is_alive()

    def cancel(self) -> None:
        """Ask it to stop and wait until it has."""
        self._cancelled.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        progress = Progress(lambda text, _final: self.lines.put(text))
        try:
            if self._plan is None:
                progress.begin("opening the scene")
                self.opened = open_scene(self._scene)
                progress.finish()
            elif self._out is not None:
                self.performance = perform(
                    self._plan,
                    self._out,
                    progress=progress,
                    opened=self._see_session,
                    watch=self._see,
                    cancelled=self._cancelled,
                )
            else:
                progress.begin("replaying")
                session = open_session(self._plan)
                self._see_session(session)
                session.run(self._see, cancelled=self._cancelled)
                progress.finish()
        except Exception as error:  # noqa: BLE001 - raised again where the window is closed
            self.failure = error

    def _see_session(self, session: Session) -> None:
        self.session = session
        self.opened = session.scene

    def _see(self, output: SessionOutput) -> None:
        self.outputs.put(output)
        if self._watch is not None:
            self._watch(output)


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
