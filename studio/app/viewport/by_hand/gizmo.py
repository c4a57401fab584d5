"""The handles by which an object is moved and turned: where they are, what a drag of one does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from studio.app.viewport.by_hand.picking import met_plane, nearest_on_line, ray_of

Handle = Literal["x", "y", "z", "floor", "yaw"]

REACH_PX = 9.0
"""How far from a handle a press still takes it, pixels."""

ARM_PX, RING_PX = 78.0, 58.0
"""Length of the arrows and radius of the ring on the screen, pixels."""

UP = np.array([0.0, 0.0, 1.0])
AXES: dict[Handle, NDArray[np.float64]] = {
    "x": np.array([1.0, 0.0, 0.0]),
    "y": np.array([0.0, 1.0, 0.0]),
    "z": UP,
}


@dataclass(frozen=True, slots=True, eq=False)
class Gizmo:
    """Handles of one object in one view.

    Attributes:
        world_from_item: pose of what is moved.
        camera, world_from_camera: the view.
        moves: whether there are arrows.
        turns: whether there is a ring.
    """

    world_from_item: Pose
    camera: Pinhole
    world_from_camera: Pose
    moves: bool = True
    turns: bool = True

    def lines(self) -> dict[Handle, NDArray[np.float64]]:
        """(N, 2) pixels of every handle that is in sight."""
        centre = self.world_from_item.translation
        size = self._metres_per_px()
        if size is None:
            return {}
        found: dict[Handle, NDArray[np.float64]] = {}
        if self.moves:
            for handle, axis in AXES.items():
                found[handle] = self._pixels(np.stack([centre, centre + ARM_PX * size * axis]))
            corner = 0.25 * ARM_PX * size
            square = np.array([[1, 1, 0], [1, 2, 0], [2, 2, 0], [2, 1, 0], [1, 1, 0]], dtype=float)
            found["floor"] = self._pixels(centre + corner * square)
        if self.turns:
            angles = np.linspace(0, 2 * math.pi, 49)
            ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
            found["yaw"] = self._pixels(centre + RING_PX * size * ring)
        return found

    def hit(self, x_px: float, y_px: float) -> Handle | None:
        """The handle under a pixel, the nearest one; None if there is none."""
        at = np.array([x_px, y_px])
        best: tuple[float, Handle] | None = None
        for handle, line in self.lines().items():
            away = _away(line, at)
            if away <= REACH_PX and (best is None or away < best[0]):
                best = (away, handle)
        return None if best is None else best[1]

    def dragged(
        self, handle: Handle, start_px: tuple[float, float], now_px: tuple[float, float]
    ) -> Pose:
        """`world_from_item` after a drag of a handle; the same where the mouse says nothing."""
        pose = self.world_from_item
        start, now = (self._ray(*at) for at in (start_px, now_px))
        centre = pose.translation
        if handle in AXES:
            axis = AXES[handle]
            a = nearest_on_line(*start, point=centre, axis=axis)
            b = nearest_on_line(*now, point=centre, axis=axis)
            return pose if a is None or b is None else _moved(pose, (b - a) * axis)
        p = met_plane(*start, point=centre, normal=UP)
        q = met_plane(*now, point=centre, normal=UP)
        if p is None or q is None:
            return pose
        if handle == "floor":
            return _moved(pose, q - p)
        before, after = (math.atan2(v[1] - centre[1], v[0] - centre[0]) for v in (p, q))
        turn = Pose.from_yaw(after - before)
        return Pose(turn.rotation @ pose.rotation, centre)

    def _ray(self, x_px: float, y_px: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return ray_of(self.camera, self.world_from_camera, x_px, y_px)

    def _metres_per_px(self) -> float | None:
        """At the item's distance; None where it is behind the viewer."""
        z = float((self.world_from_camera.inverse() @ self.world_from_item.translation)[2])
        return z / self.camera.fx if z > 0.05 else None

    def _pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        pixels, _ = self.camera.project(self.world_from_camera.inverse() @ points)
        return pixels


def _moved(pose: Pose, by: NDArray[np.float64]) -> Pose:
    return Pose(pose.rotation, pose.translation + by)


def _away(line: NDArray[np.float64], at: NDArray[np.float64]) -> float:
    """Distance of a place from a polyline."""
    a, b = line[:-1], line[1:]
    along = b - a
    length = np.maximum((along**2).sum(axis=1), 1e-9)
    share = np.clip(((at - a) * along).sum(axis=1) / length, 0, 1)
    away = np.linalg.norm(a + share[:, None] * along - at, axis=1)
    return float(np.nanmin(away)) if len(away) else math.inf
