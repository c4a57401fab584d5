"""Memory of one view: splats and meshes that stay as they are between pictures are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from scenes.cameras import Pinhole
from scenes.pose import Pose
from studio.app.viewport.drawing.mesh_picture import MeshPicture
from studio.app.viewport.drawing.scene_drawing import MeshThread, SceneDrawing
from studio.app.viewport.drawing.shapes import Shape


class ViewMemory:
    """Remembers what one view showed last; for one caller at a time.

    Where OpenGL runs on the processor a camera's marker costs 87 ms of a picture of 804 × 776, and
    it mostly stands still.

    Args:
        drawing: of the scene.
    """

    def __init__(self, drawing: SceneDrawing) -> None:
        self.splats = drawing.resting_view()
        """Splats of the view."""
        self._from: tuple[Pinhole, bytes] | None = None
        self._shapes: tuple[Shape, ...] = ()
        self._meshes: MeshPicture | None = None

    def meshes(
        self,
        thread: MeshThread,
        shapes: Sequence[Shape],
        *,
        camera: Pinhole,
        world_from_camera: Pose,
    ) -> MeshPicture | None:
        """Return shapes through a camera, those of the last picture if all is as it was.

        Args:
            thread: draws shapes.
            shapes: what to draw.
            camera: looked through.
            world_from_camera: from where.
        """
        seen = camera, world_from_camera.matrix().tobytes()
        is_same = (
            self._meshes is not None
            and seen == self._from
            and len(shapes) == len(self._shapes)
            and all(map(is_same_shape, shapes, self._shapes))
        )
        if not is_same:
            self._meshes = thread.draw(shapes, camera, world_from_camera)
            self._from, self._shapes = seen, tuple(shapes)
        return self._meshes


def is_same_shape(one: Shape, other: Shape) -> bool:
    """Return whether two shapes are drawn the same way: equal values, or the same large arrays."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    return all(_is_same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))


def _is_same(one: Any, other: Any) -> bool:
    if one is other:
        return True
    if isinstance(one, Pose) and isinstance(other, Pose):
        return np.array_equal(one.matrix(), other.matrix())
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    return bool(one == other)
