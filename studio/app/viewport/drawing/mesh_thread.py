"""One thread with one OpenGL context that draws the shapes of all views of a window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from devices.streams import BoundedQueue, Slot, StreamClosedError, StreamFullError
from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.workers.task import Task
from studio.app.viewport.drawing.mesh_picture import (
    NO_OPENGL,
    MeshDrawer,
    MeshPicture,
    NoOpenGLError,
)
from studio.app.viewport.drawing.opengl_trial import can_try_opengl
from studio.app.viewport.drawing.shapes import Shape

MAX_WAITING = 16
"""Pictures that wait at a time: every view and small picture waits for one of its own at most."""


SAMPLES = 4
"""Of a pixel: edges of meshes have no steps. At 960 × 540 that costs 30 ms of a CPU's time where
there is no GPU; pictures of a moving view, a quarter as large, 8 ms."""


@dataclass(frozen=True, slots=True, eq=False)
class _Wanted:
    """A picture that somebody waits for; the slot is closed without one if there is none."""

    shapes: Sequence[Shape]
    camera: Pinhole
    world_from_camera: Pose
    drawn: Slot[MeshPicture] = field(default_factory=Slot)


class MeshThread:
    """Draws shapes for whoever asks, one after the other. Methods may be called from any thread."""

    def __init__(self) -> None:
        self.problems: Slot[str] = Slot()
        """Why meshes cannot be drawn here, once."""
        self._queue: BoundedQueue[_Wanted] = BoundedQueue(MAX_WAITING, name="mesh pictures")
        self._task = Task("meshes", self._run)
        self._task.start()

    def draw(
        self, shapes: Sequence[Shape], camera: Pinhole, world_from_camera: Pose
    ) -> MeshPicture | None:
        """Draw shapes through a camera and wait; None where there is no OpenGL, or when closed."""
        wanted = _Wanted(shapes, camera, world_from_camera)
        try:
            self._queue.put(wanted)
        except (StreamClosedError, StreamFullError):
            return None
        return wanted.drawn.take(timeout_s=None)

    def close(self) -> None:
        """Give the context back; who still waits gets no picture."""
        self._queue.close()
        self._task.join()

    def _run(self, _task: Task[None]) -> None:
        drawer: MeshDrawer | None = None
        try:
            if not can_try_opengl():
                raise NoOpenGLError(NO_OPENGL)  # noqa: TRY301 - said as VTK's own refusal is
            drawer = MeshDrawer(samples=SAMPLES)
            while (wanted := self._queue.take(timeout_s=None)) is not None:
                wanted.drawn.put(
                    drawer.draw(wanted.shapes, wanted.camera, wanted.world_from_camera)
                )
                wanted.drawn.close()
        except (NoOpenGLError, ImportError) as error:
            self.problems.put(str(error))
        finally:
            self._queue.close()
            while (left := self._queue.take()) is not None:
                left.drawn.close()
            if drawer is not None:
                drawer.close()
