"""Between which depths each pixel of a photo shows a surface, by what photo pairs have seen.

Where stereo has seen the depth the bounds are tight, where it goes on from there they are wide, and
around the edges of things they hold both what is in front and what is behind.
"""

from __future__ import annotations

import cv2
import numpy as np

from scenes.cameras import Fisheye, Pinhole
from scenes.prepare.train.seen_surfaces import Surface
from scenes.render.training import FARTHEST, DepthBounds

SEEN_SLACK, LENT_SLACK, FILLED_SLACK = 0.003, 0.01, 0.15
"""A surface may be nearer or farther than seen by so much of its depth."""
EDGE_PX = 1
"""Depths so many pixels of the surface aside count as well: splats are not points."""


def depth_bounds(surface: Surface, camera: Pinhole | Fisheye) -> DepthBounds:
    """What a surface says about the pixels of its photo.

    Args:
        surface: of the same view.
        camera: its lens at the size wanted.
    """
    slack = np.select([surface.is_seen, surface.is_lent], [SEEN_SLACK, LENT_SLACK], FILLED_SLACK)
    slack = slack.astype(np.float32)
    around = np.ones((2 * EDGE_PX + 1, 2 * EDGE_PX + 1), dtype=np.uint8)
    near = cv2.erode(surface.depth * (1 - slack), around)
    # Between a thing and what is behind it, what is filled in hangs in front of both.
    is_known = surface.is_seen | surface.is_lent
    far = cv2.dilate(np.where(is_known, surface.depth * (1 + slack), FARTHEST), around)
    size = (camera.width_px, camera.height_px)
    near, far = (cv2.resize(v, size, interpolation=cv2.INTER_NEAREST) for v in (near, far))
    return DepthBounds(
        np.asarray(near, dtype=np.float32), np.minimum(far, FARTHEST).astype(np.float32)
    )
