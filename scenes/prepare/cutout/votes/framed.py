"""The splats that may show in a picture: most of a room lies beside a crop around one object."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.renderer import ALPHA_MAX, ALPHA_MIN
from scenes.splats import SplatCloud

REACH = float(np.sqrt(2.0 * np.log(ALPHA_MAX / ALPHA_MIN)))
"""Standard deviations from its mean beyond which no splat is drawn: there its alpha is below the
least that counts."""
BESIDE_PX = 4.0
"""Beside the picture's rim splats are kept so far: their low pass reaches `REACH` times 0.55 px."""


def framed(cloud: SplatCloud, camera: Pinhole, world_from_camera: Pose) -> NDArray[np.intp]:
    """(K,) places of the splats that reach into the pyramid of a picture, in their order.

    Args:
        cloud: world frame.
        camera: of the picture.
        world_from_camera: its pose.
    """
    turn = world_from_camera.rotation.astype(np.float32)
    x, y, z = turn.T @ (cloud.means - world_from_camera.translation.astype(np.float32)).T
    first, second, third = cloud.scales.T
    # Of three columns; a row at a time takes ten times as long.
    reach = np.float32(REACH) * np.maximum(np.maximum(first, second), third)
    is_in = z > -reach
    for along, focal, middle, size in (
        (x, camera.fx, camera.cx, camera.width_px),
        (y, camera.fy, camera.cy, camera.height_px),
    ):
        for sign, toward in ((1.0, middle + BESIDE_PX), (-1.0, size - middle + BESIDE_PX)):
            norm = float(np.hypot(focal, toward))
            depth = np.float32(sign * focal / norm) * along + np.float32(toward / norm) * z
            is_in &= depth > -reach
    return np.flatnonzero(is_in)
