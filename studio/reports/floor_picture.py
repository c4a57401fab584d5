"""The room from above as a background for floor plans."""

from __future__ import annotations

import numpy as np

from scenes.package import ScenePackage
from scenes.render.native import NativeRenderer
from studio.evaluate.figures import Background
from studio.view.twin import Twin

SIZE_PX = 900
"""Side of the picture: as wide as a floor plan on a page."""


def floor_picture(scene: ScenePackage) -> Background:
    """The room without its ceiling, and the part of the floor that the picture covers."""
    twin = Twin(scene, NativeRenderer())
    picture = twin.picture_from_above({}, SIZE_PX)
    camera, world_from_camera = twin.above(SIZE_PX)
    corners = camera.unproject(np.array([[0.0, 0.0], [SIZE_PX, SIZE_PX]]))
    height = world_from_camera.translation[2]
    floor = world_from_camera @ (corners * (height / corners[:, 2:3]))
    (left, top), (right, bottom) = floor[0, :2], floor[1, :2]
    return picture, (float(left), float(right), float(bottom), float(top))
