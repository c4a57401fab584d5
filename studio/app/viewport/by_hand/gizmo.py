"""The handles by which an item is moved, turned and sized: where they are, what a drag does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from studio.app.viewport.by_hand.picking import met_plane, nearest_on_line, ray_of

Handle = Literal[
    "x", "y", "z", "floor", "yaw", "tilt_x", "tilt_y", "size", "size_x", "size_y", "size_z"
]
"""An arrow each, a square on the floor, a ring each, and what sizes all sides or one."""

REACH_PX = 9.0
"""How far from a handle a press still takes it, pixels."""

ARM_PX, RING_PX = 78.0, 58.0
"""Length of the arrows and radius of the rings on the screen, pixels."""

MIN_FACTOR = 0.01
"""Smallest factor that one drag gives a side: through the middle it would turn inside out."""

UP = np.array([0.0, 0.0, 1.0])
AXES: dict[Handle, NDArray[np.float64]] = {
    "x": np.array([1.0, 0.0, 0.0]),
    "y": np.array([0.0, 1.0, 0.0]),
    "z": UP,
}
SIDES: dict[Handle, int] = {"size_x": 0, "size_y": 1, "size_z": 2}
"""The item's own axis that each sizes."""


@dataclass(frozen=True, slots=True, eq=False)
class Gizmo:
    """Handles of one item in one view.

    Attributes:
        world_from_item: pose of what is moved.
        camera, world_from_camera: the view.
        moves: whether there are arrows.
        turns: whether there is a ring about up.
        tilts: whether there are rings about the two level axes, too.
        sizes: whether there is a handle that sizes all sides alike.
        sides: whether there is one for each side.
        heading_rad: the first level axis, about up from world +X.
    """

    world_from_item: Pose
    camera: Pinhole
    world_from_camera: Pose
    moves: bool = True
    turns: bool = True
    tilts: bool = False
    sizes: bool = False
    sides: bool = False
    heading_rad: float = 0.0

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
        for handle, axis in self._rings().items():
            found[handle] = self._pixels(centre + RING_PX * size * _circle(axis))
        if self.sides:
            for handle, side in SIDES.items():
                tip = centre + ARM_PX * size * self.world_from_item.rotation[:, side]
                found[handle] = self._pixels(np.stack([centre, tip]))
        if self.sizes or self.sides:
            (middle,) = self._pixels(centre[None])
            # Between the arrows of a room that is seen from above, on the screen itself.
            found["size"] = np.array([[0.45, -0.45], [0.75, -0.75]]) * ARM_PX + middle
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
        about = self._rings().get(handle, UP)
        p = met_plane(*start, point=centre, normal=about)
        q = met_plane(*now, point=centre, normal=about)
        if p is None or q is None:
            return pose
        if handle == "floor":
            return _moved(pose, q - p)
        across = np.cross(about, p - centre)
        angle = math.atan2(float(across @ (q - centre)), float((p - centre) @ (q - centre)))
        return Pose(_turn(about, angle) @ pose.rotation, centre)

    def sized(
        self, handle: Handle, start_px: tuple[float, float], now_px: tuple[float, float]
    ) -> tuple[float, float, float]:
        """Factors of the item's sides after a drag of a handle that sizes."""
        centre = self.world_from_item.translation
        factors = [1.0, 1.0, 1.0]
        if handle == "size":
            (middle,) = self._pixels(centre[None])
            a, b = (float(np.linalg.norm(np.array(at) - middle)) for at in (start_px, now_px))
            factor = max(b / max(a, 1.0), MIN_FACTOR)
            return factor, factor, factor
        side = SIDES[handle]
        axis = self.world_from_item.rotation[:, side]
        ends = [
            nearest_on_line(*self._ray(*at), point=centre, axis=axis) for at in (start_px, now_px)
        ]
        first, last = ends
        if first is not None and last is not None and abs(first) > 1e-6:
            factors[side] = max(last / first, MIN_FACTOR)
        return factors[0], factors[1], factors[2]

    def _rings(self) -> dict[Handle, NDArray[np.float64]]:
        """The axis that each ring turns about."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        found: dict[Handle, NDArray[np.float64]] = {"yaw": UP} if self.turns else {}
        if self.tilts:
            found["tilt_x"] = np.array([c, s, 0.0])
            found["tilt_y"] = np.array([-s, c, 0.0])
        return found

    def _ray(self, x_px: float, y_px: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return ray_of(self.camera, self.world_from_camera, x_px, y_px)

    def _metres_per_px(self) -> float | None:
        """At the item's distance; None where it is behind the viewer."""
        z = float((self.world_from_camera.inverse() @ self.world_from_item.translation)[2])
        return z / self.camera.fx if z > 0.05 else None

    def _pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        pixels, _ = self.camera.project(self.world_from_camera.inverse() @ points)
        return pixels


def _circle(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """(49, 3) a circle of radius 1 about an axis of length 1."""
    first = np.cross(axis, UP) if abs(axis[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    second = np.cross(axis, first)
    angles = np.linspace(0, 2 * math.pi, 49)[:, None]
    return np.cos(angles) * first + np.sin(angles) * second


def _turn(axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """(3, 3) rotation about an axis of length 1 (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


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
