"""A view of the room with the mask of one object: what the marks give to the votes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose


@dataclass(frozen=True, slots=True, eq=False)
class MaskedView:
    """A view of the room with the mask of one object.

    Attributes:
        name: of the view, for messages.
        camera: its lens.
        world_from_camera: its pose.
        mask: (H, W) bool.
        box_px: (left, top, right, bottom) that the whole object lies in, if somebody has said so.
        inside_px: (K, 2) points that somebody put on the object.
        outside_px: (K, 2) points that somebody put beside it.

    Raises:
        ValueError: the mask is not of the camera's size.
    """

    name: str
    camera: Pinhole | Fisheye
    world_from_camera: Pose
    mask: NDArray[np.bool_]
    box_px: tuple[float, float, float, float] | None = None
    inside_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    outside_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        wanted = (self.camera.height_px, self.camera.width_px)
        if self.mask.shape != wanted:
            raise ValueError(f"view {self.name}: mask {self.mask.shape}, wanted {wanted}")
