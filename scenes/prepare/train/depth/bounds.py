"""Between which depths each pixel of a photo shows a surface, by what photo pairs have seen.

Bounds are tight where this photo's pairs or another's have seen the depth. What is filled in
between those bounds nothing: a plain seat would be taken for the floor that is seen around it.
"""

from __future__ import annotations

import cv2
import numpy as np

from scenes.cameras import Fisheye, Pinhole
from scenes.prepare.train.depth.seen_surfaces import Surface
from scenes.render.training import FARTHEST, DepthBounds

SEEN_SLACK, LENT_SLACK = 0.003, 0.006
"""A surface may be nearer or farther by so much of its depth. Little: a splat is seen by many
photos, whose errors cancel where its price has a slope for each."""


def depth_bounds(surface: Surface, camera: Pinhole | Fisheye) -> DepthBounds:
    """Depth bounds of a photo's pixels by its surface.

    Args:
        surface: of the same view.
        camera: its lens at the size wanted.
    """
    slack = np.where(surface.is_seen, SEEN_SLACK, LENT_SLACK)
    is_known = surface.is_seen | surface.is_propagated
    near = np.where(is_known, surface.depth * (1 - slack), 0.0)
    far = np.where(is_known, surface.depth * (1 + slack), FARTHEST)
    size = (camera.width_px, camera.height_px)
    near, far = (cv2.resize(v, size, interpolation=cv2.INTER_NEAREST) for v in (near, far))
    return DepthBounds(near.astype(np.float32), far.astype(np.float32))
