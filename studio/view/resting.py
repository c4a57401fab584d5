"""A view that rests: its splats are drawn again only where objects moved, to the same pixels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import TILE_PX, PosedSplats, RenderOptions
from scenes.render.still import StillView

Picture = NDArray[np.uint8]
Depth = NDArray[np.float32]


class RestingView:
    """Draws the splats of one view, anew once it is looked at from elsewhere.

    For one caller at a time. The second picture from a place keeps what it was drawn from, some 25
    bytes a pixel and 80 a splat in sight; those after it cost what moved. A view that moves is
    drawn as without this.

    Args:
        renderer: draws splats.
    """

    def __init__(self, renderer: NativeRenderer) -> None:
        self._renderer = renderer
        self._key: object = None
        self._still: StillView | None = None
        self._picture: Picture | None = None

    def draw(
        self,
        clouds: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        *,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> tuple[Picture, Depth]:
        """Return (H, W, 3) RGB and (H, W) metres, which the caller may paint on.

        Args:
            clouds: the room first, then what moves.
            camera: looked through.
            world_from_camera: from where.
            options: how; a background that is a picture is drawn as a view that moves.
        """
        key = _key_of(clouds, camera, world_from_camera=world_from_camera, options=options)
        if key is None or key != self._key:
            self._key, self._still = key, None
            drawn = self._renderer.render(clouds, camera, world_from_camera, options)
            return in_bytes(drawn.rgb), drawn.depth
        if self._still is None:
            self._still = StillView(
                self._renderer, camera, world_from_camera=world_from_camera, options=options
            )
            self._picture = None
        fresh = self._still.update(clouds)
        rgb, depth = fresh.rendering.rgb, fresh.rendering.depth
        if self._picture is None:
            self._picture = in_bytes(rgb)
        else:
            for row in np.flatnonzero(fresh.drawn.any(axis=1)):
                columns = np.flatnonzero(fresh.drawn[row])
                part = (
                    slice(TILE_PX * row, TILE_PX * (row + 1)),
                    slice(TILE_PX * columns[0], TILE_PX * (columns[-1] + 1)),
                )
                self._picture[part] = in_bytes(rgb[part])
        return self._picture.copy(), depth.copy()


def in_bytes(rgb: NDArray[np.float32]) -> Picture:
    """Return colours 0..1 as 0..255, rounded."""
    return (np.clip(rgb, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def _key_of(
    clouds: Sequence[PosedSplats],
    camera: Pinhole | Fisheye,
    *,
    world_from_camera: Pose,
    options: RenderOptions,
) -> object:
    """Return all that must stay for a picture to be brought up to date; None if it cannot be."""
    if isinstance(options.background, np.ndarray) or not clouds:
        return None
    room = clouds[0]
    return (
        camera,
        world_from_camera.matrix().tobytes(),
        options.background,
        options.near_m,
        id(room.cloud),
        room.world_from_object.matrix().tobytes(),
    )
