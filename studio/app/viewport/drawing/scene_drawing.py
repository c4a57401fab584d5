"""Drawing of a scene that all views share: its splats, and the thread that draws meshes.

A view has a thread of its own for its pictures of splats; what costs memory or an OpenGL context
is there once.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field

from devices.streams import BoundedQueue, Slot, StreamClosedError, StreamFullError
from scenes.bodies.crowd import Crowd
from scenes.bodies.figure import rest_figure
from scenes.bodies.furniture import Furniture
from scenes.cameras import Pinhole
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.workers.task import Task
from studio.app.viewport.drawing.mesh_picture import (
    NO_OPENGL,
    MeshDrawer,
    MeshPicture,
    NoOpenGLError,
)
from studio.app.viewport.drawing.outlines import Outlines
from studio.app.viewport.drawing.shapes import Shape
from studio.view.furniture import furniture_of
from studio.view.resting import RestingView
from studio.view.twin import Twin

MAX_WAITING = 16
"""Pictures that wait at a time: every view and small picture waits for one of its own at most."""

SAMPLES = 4
"""Of a pixel: edges of meshes have no steps. At 960 × 540 that costs 30 ms of a CPU's time where
there is no GPU; pictures of a moving view, a quarter as large, 8 ms."""

TRIAL_S = 30.0
"""How long the trial in a process of its own may take: VTK's libraries are 300 MB to load."""

TRIAL = "from studio.app.viewport.drawing.mesh_picture import MeshDrawer; MeshDrawer().close()"


class SceneDrawing:
    """Draws one scene for any number of views.

    Args:
        scene: the scan.
    """

    def __init__(self, scene: ScenePackage) -> None:
        self.scene = scene
        self._renderer = NativeRenderer()
        self.twin = Twin(scene, self._renderer)
        self.outlines = Outlines()
        """Draws shapes where there is no OpenGL."""
        self.furniture: Furniture | None = None
        """Solids that people's hands stay out of; None before `prepare`."""
        self._meshes: MeshThread | None = None
        self._preparing = threading.Lock()
        self._is_prepared = self._is_closed = False

    @property
    def meshes(self) -> MeshThread | None:
        """Draws shapes; None before `prepare`."""
        return self._meshes

    @property
    def is_prepared(self) -> bool:
        """Whether `prepare` is done."""
        return self._is_prepared

    def prepare(self) -> None:
        """Prepare what the first picture does without: coarse splats and OpenGL.

        It may be called from any thread: the first one does it, the others wait.
        """
        with self._preparing:
            if self._is_prepared or self._is_closed:
                return
            self.twin.make_coarse()
            rest_figure()
            self.furniture = furniture_of(self.scene)
            self._meshes = MeshThread()
            self._is_prepared = True

    def resting_view(self) -> RestingView:
        """Return a memory of one view, which spares what did not move in it."""
        return RestingView(self._renderer)

    def problem(self) -> str | None:
        """Why meshes cannot be drawn here, once."""
        return None if self._meshes is None else self._meshes.problems.take()

    def close(self) -> None:
        """Give the OpenGL context back."""
        with self._preparing:
            self._is_closed = True
        if self._meshes is not None:
            self._meshes.close()


class Drawings:
    """The drawing of the scene that is open: there from the first view that asks for it."""

    def __init__(self) -> None:
        self._now: SceneDrawing | None = None
        self._crowd = Crowd()

    @property
    def crowd(self) -> Crowd:
        """People of what is shown now: all views see the same figures."""
        self._crowd.furniture = None if self._now is None else self._now.furniture
        return self._crowd

    def of(self, scene: ScenePackage) -> SceneDrawing:
        """The scene's drawing; that of another scene is closed."""
        if self._now is None or self._now.scene is not scene:
            self.close()
            self._now = SceneDrawing(scene)
        return self._now

    def problem(self) -> str | None:
        """See `SceneDrawing.problem`."""
        return None if self._now is None else self._now.problem()

    def close(self) -> None:
        """The scene is no longer shown."""
        if self._now is not None:
            self._now.close()
        self._now = None


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


def can_try_opengl() -> bool:
    """Whether VTK may be asked for a picture in this process.

    EGL that can be initialised is enough. Without it VTK looks for other ways, and a driver that
    fails there takes the process with it (a segmentation fault in VTK 9.5): that is tried in a
    process of its own.
    """
    if not sys.platform.startswith("linux") or _has_egl():
        return True
    try:
        done = subprocess.run(
            [sys.executable, "-c", TRIAL],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=TRIAL_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def _has_egl() -> bool:
    name = ctypes.util.find_library("EGL")
    if name is None:
        return False
    try:
        egl = ctypes.CDLL(name)
    except OSError:
        return False
    egl.eglGetDisplay.restype = ctypes.c_void_p
    egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    display = egl.eglGetDisplay(None)
    return bool(display) and bool(egl.eglInitialize(display, None, None))
