"""The paper's rectified front view, compared with the empty room."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Pinhole, Rig
from scenes.pose import Pose
from scenes.warp import VirtualView, front_view, warp
from tracking.background.images import BackgroundImages, Difference, Exposure, difference, expose

FRONT_SIZE_PX = 640
"""Side of the rectified view (paper 4.4.1)."""


@dataclass(frozen=True, slots=True, eq=False)
class RectifiedView:
    """A pinhole picture cut out of one lens, with what is known about it.

    Attributes:
        image: (H, W, 3) uint8 RGB.
        camera: the pinhole.
        world_from_camera: its pose.
        difference: against the empty room, or None where no room scan is known.
        valid: (H, W) bool, whether the lens sees that direction.
    """

    image: NDArray[np.uint8]
    camera: Pinhole
    world_from_camera: Pose
    difference: Difference | None
    valid: NDArray[np.bool_]


def rectify(
    frame: Frame,
    view: VirtualView,
    background: BackgroundImages | None = None,
    exposures: tuple[Exposure, ...] = (),
) -> RectifiedView:
    """Cut a view out of a frame and compare it with the empty room.

    Args:
        frame: the live pictures.
        view: which lens, camera and table.
        background: the empty room, or None to skip the comparison.
        exposures: one per lens, of this frame.
    """
    image = np.asarray(warp(frame.images[view.lens], view.table), dtype=np.uint8)
    change = None
    if background is not None:
        background_image = expose_view(view, background, exposures[view.lens])
        noise = np.asarray(warp(background.noise[view.lens].whole(), view.table), dtype=np.float32)
        seen = view.table.valid
        change = difference(
            image.astype(np.float32) / 255.0, background_image, np.maximum(noise, 1e-3)
        )
        change = Difference(change.probability * seen, change.expected, change.live)
    return RectifiedView(image, view.camera, view.world_from_camera, change, view.table.valid)


def expose_view(
    view: VirtualView, background: BackgroundImages, exposure: Exposure
) -> NDArray[np.float32]:
    """(H, W, 3) float32: the empty room in a view, at the live exposure."""
    background_image = background.images[view.lens].whole()
    warped = np.asarray(warp(background_image, view.table), dtype=np.float32)
    height, width = background_image.shape[:2]
    map_xy = view.table.map_xy
    x = ((map_xy[..., 0] + 0.5) / width - 0.5) * 2.0
    y = ((map_xy[..., 1] + 0.5) / height - 0.5) * 2.0
    return expose(warped, exposure, radius2=x * x + y * y)


def front(rig: Rig, world_from_rig: Pose, *, fov_deg: float) -> VirtualView:
    """The paper's 640×640 rectified front view; `fov_deg` is what the local user adjusts.

    Raises:
        ValueError: the field of view is outside 10..175 degrees.
    """
    if not 10.0 <= fov_deg <= 175.0:
        raise ValueError(f"rectified view: field of view {fov_deg}°, wanted 10..175°")
    return front_view(rig, world_from_rig, size_px=FRONT_SIZE_PX, fov=math.radians(fov_deg))
