"""Foremost body by pixel: how much of each pixel one object makes up, and its depth there.

`Rendering.ids` names the object of the single heaviest splat of a pixel, which flickers where many
faint splats make up a surface. Here all splats of an object count together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions


@dataclass(frozen=True, slots=True, eq=False)
class Front:
    """One object within a picture of several; all arrays (H, W) float32.

    Attributes:
        share: sum of the blend weights of the object's splats, 0..1: how much of the pixel's light
            comes from it, what hides it counted out.
        alpha: sum over all objects, as in `Rendering`; `share` is at most that.
        depth_m: mean depth of the object's splats by weight (z for a pinhole, range for a fisheye);
            0 where `share` is 0.
        rest_depth_m: that of all other objects; 0 where they have no weight.
    """

    share: NDArray[np.float32]
    alpha: NDArray[np.float32]
    depth_m: NDArray[np.float32]
    rest_depth_m: NDArray[np.float32]

    @property
    def is_seen(self) -> NDArray[np.bool_]:
        """(H, W) whether the object makes up more than half of what the pixel shows."""
        return self.share > 0.5 * self.alpha

    @property
    def is_front(self) -> NDArray[np.bool_]:
        """(H, W) `is_seen`, and what else shows there lies behind it on the mean."""
        return self.is_seen & ((self.rest_depth_m == 0) | (self.depth_m <= self.rest_depth_m))


class SharesRenderer(Protocol):
    """A renderer that can add up one object's part of a picture."""

    def shares(
        self,
        objects: Sequence[PosedSplats],
        index: int,
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> Rendering:
        """A rendering whose rgb is weight and weighted depth of one object, and of the rest."""
        ...


def front_of(
    renderer: SharesRenderer,
    objects: Sequence[PosedSplats],
    index: int,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    options: RenderOptions | None = None,
) -> Front:
    """Contribution of `objects[index]` to the picture of all; costs about one picture.

    Outside `options.region` and `options.tile_mask` everything is 0.

    Raises:
        ValueError: names the argument, what it got and what it wants.
    """
    if not 0 <= index < len(objects):
        raise ValueError(f"index: got {index}, wanted 0 to {len(objects) - 1}")
    options = options or RenderOptions()
    sums = renderer.shares(objects, index, camera, world_from_camera, options)
    share, depth, rest_depth = np.moveaxis(sums.rgb, 2, 0)
    # What one minus the light let through leaves of the rest is rounding where it is tiny.
    rest = np.where(rest_depth > 0, np.maximum(sums.alpha - share, np.float32(1e-6)), 0)
    return Front(
        np.ascontiguousarray(share),
        sums.alpha,
        np.divide(depth, share, out=np.zeros_like(share), where=share > 0),
        np.divide(rest_depth, rest, out=np.zeros_like(share), where=rest > 0),
    )
