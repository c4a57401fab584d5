"""The four handles of a live surface: where they are, and what a drag of one gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.quad import quad_of
from scenes.state import LiveSurface
from studio.app.viewport.by_hand.picking import MARGIN_M, met_plane, ray_of

REACH_PX = 11.0
"""How far from a corner a press still takes it, pixels: a little more than the drawn dot."""

FARTHEST_M = 20.0
"""How far from the surface's middle a corner can be dragged, metres: no room is larger, and near
the plane's horizon a pixel is many metres."""


@dataclass(frozen=True, slots=True, eq=False)
class CornerHandles:
    """Handles of one live surface in one view.

    Attributes:
        surface: as it was when the drag began: its plane stays while a corner moves on it.
        camera, world_from_camera: the view.
    """

    surface: LiveSurface
    camera: Pinhole
    world_from_camera: Pose

    def pixels(self) -> NDArray[np.float64]:
        """(4, 2) pixels of the corners; NaN where one is out of sight."""
        corners = self.world_from_camera.inverse() @ self.surface.corners_in_world
        pixels, is_seen = self.camera.project(corners)
        return np.where(np.asarray(is_seen)[:, None], pixels, np.nan)

    def hit(self, x_px: float, y_px: float) -> int | None:
        """The corner (0 top left, clockwise) under a pixel, the nearest one; None if none is."""
        away = np.linalg.norm(self.pixels() - (x_px, y_px), axis=1)
        if not (away <= REACH_PX).any():
            return None
        return int(np.nanargmin(away))

    def dragged(self, x_px: float, y_px: float) -> NDArray[np.float64] | None:
        """(3,) where a pixel meets the surface's plane, world metres; None far beyond it."""
        corners = self.surface.corners_in_world
        plane = quad_of(corners).world_from_plane
        eye, ray = ray_of(self.camera, self.world_from_camera, x_px, y_px)
        place = met_plane(eye, ray, point=plane.translation, normal=plane.rotation[:, 2])
        if place is None or np.linalg.norm(place - corners.mean(axis=0)) > FARTHEST_M:
            return None
        return place


def surface_at(surfaces: Mapping[str, LiveSurface], point: NDArray[np.float64]) -> str:
    """Id of the live surface that a world place (3,) lies on, the last added first; "": none."""
    for surface_id, surface in reversed(tuple(surfaces.items())):
        try:
            quad = quad_of(surface.corners_in_world)
        except ValueError:  # one of a recording: nothing is held to our rules there
            continue
        x, y, off = quad.world_from_plane.inverse() @ point
        (across, down), *_ = quad.places([[x, y]])
        if abs(off) <= MARGIN_M and 0.0 <= across <= 1.0 and 0.0 <= down <= 1.0:
            return surface_id
    return ""
