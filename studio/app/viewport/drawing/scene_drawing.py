"""Drawing of a scene that all views share: its splats, and the thread that draws meshes.

A view has a thread of its own for its pictures of splats; what costs memory or an OpenGL context
is there once.
"""

from __future__ import annotations

import threading

from scenes.bodies.crowd import Crowd
from scenes.bodies.figure import rest_figure
from scenes.bodies.furniture import Furniture
from scenes.package import ScenePackage
from scenes.render.native import NativeRenderer
from studio.app.viewport.drawing.mesh_thread import MeshThread
from studio.app.viewport.drawing.outlines import Outlines
from studio.view.furniture import furniture_of
from studio.view.twin import Twin


class SceneDrawing:
    """Draws one scene for any number of views.

    Args:
        scene: the scan.
    """

    def __init__(self, scene: ScenePackage) -> None:
        self.scene = scene
        self.twin = Twin(scene, NativeRenderer())
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
