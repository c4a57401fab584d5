"""Pictures of a camera that stands still: only tiles that a change touches are drawn again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.picture_memory import rendering_of
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions, tiles_of


@dataclass(frozen=True, slots=True, eq=False)
class Refresh:
    """A still view after an update.

    Attributes:
        rendering: the whole picture, read-only. It is the view's own memory, which the next update
            overwrites: copy what has to outlive it.
        drawn: (ceil(H / TILE_PX), ceil(W / TILE_PX)) bool, the tiles that were drawn again; all
            others hold what they held before.
    """

    rendering: Rendering
    drawn: NDArray[np.bool_]


class StillView:
    """One camera in one place, its last picture, and the objects that picture shows.

    The picture after each update equals, to the bit, what `renderer.render` draws of the same
    objects. An object is unchanged if the same `SplatCloud` stands at the same place of the list in
    the same pose; one that appears, goes, moves or changes place costs the tiles it touches, before
    and after. Keep objects that come and go at the end of the list. One caller at a time.

    Args:
        renderer: whose kernels and prepared clouds are used.
        camera: lens and size of the picture.
        world_from_camera: where the camera stands.
        options: how to draw, the number of threads included.

    Raises:
        ValueError: names the argument, what it got and what it wants.
    """

    def __init__(
        self,
        renderer: NativeRenderer,
        camera: Pinhole | Fisheye,
        *,
        world_from_camera: Pose,
        options: RenderOptions | None = None,
    ) -> None:
        self._renderer = renderer
        self._camera = camera
        self._world_from_camera = world_from_camera
        self._options = options or RenderOptions()
        self._picture = renderer.still_picture(camera, self._options)
        self._rendering = _read_only(
            rendering_of(self._picture.arrays, camera.height_px, camera.width_px)
        )

    def update(self, objects: Sequence[PosedSplats]) -> Refresh:
        """Bring the picture to `objects`; the first update draws all of it.

        Raises:
            ValueError: names the argument, what it got and what it wants.
        """
        drawn = self._renderer.update_still(
            self._picture, objects, self._camera, self._world_from_camera, self._options
        )
        return Refresh(self._rendering, drawn.reshape(tiles_of(self._camera)))


def _read_only(rendering: Rendering) -> Rendering:
    for array in (rendering.rgb, rendering.alpha, rendering.depth, rendering.ids):
        if array is not None:
            array.flags.writeable = False
    return rendering
