"""A camera that circles a point: what the mouse and the keys move in the window."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from scenes.frames import look_at
from scenes.pose import Pose

MAX_PITCH = math.radians(88.0)
MIN_DISTANCE_M, MAX_DISTANCE_M = 0.2, 50.0
TURN_PER_PX = math.radians(0.35)
ZOOM_PER_STEP = 0.88


@dataclass(frozen=True, slots=True)
class Orbit:
    """Pose of the viewer: target, direction and distance.

    Attributes:
        target: what the viewer looks at, world metres.
        yaw: direction from the target to the viewer about up, radians.
        pitch: its height above the horizon, radians, between ±88°.
        distance_m: from the target to the viewer.
    """

    target: tuple[float, float, float]
    yaw: float
    pitch: float
    distance_m: float

    def world_from_camera(self) -> Pose:
        """The camera's pose."""
        eye = np.array(self.target) + self.distance_m * self._outward()
        return look_at(eye, np.array(self.target))

    def turned(self, dx_px: float, dy_px: float) -> Orbit:
        """After a drag of so many pixels: the room follows the mouse."""
        pitch = min(MAX_PITCH, max(-MAX_PITCH, self.pitch + TURN_PER_PX * dy_px))
        return replace(self, yaw=self.yaw - TURN_PER_PX * dx_px, pitch=pitch)

    def looked(self, dx_px: float, dy_px: float) -> Orbit:
        """After a drag that turns the viewer's head: the viewer stays, the target moves."""
        eye = np.array(self.target) + self.distance_m * self._outward()
        pitch = min(MAX_PITCH, max(-MAX_PITCH, self.pitch + TURN_PER_PX * dy_px))
        turned = replace(self, yaw=self.yaw + TURN_PER_PX * dx_px, pitch=pitch)
        x, y, z = (float(v) for v in eye - self.distance_m * turned._outward())
        return replace(turned, target=(x, y, z))

    def panned(self, dx_px: float, dy_px: float, *, focal_px: float) -> Orbit:
        """After a sideways drag: the target stays under the mouse."""
        rotation = self.world_from_camera().rotation
        metres = self.distance_m / focal_px
        return self._shifted(-metres * (dx_px * rotation[:, 0] + dy_px * rotation[:, 1]))

    def zoomed(self, steps: float) -> Orbit:
        """After so many steps of the wheel, closer when positive."""
        distance = self.distance_m * ZOOM_PER_STEP**steps
        return replace(self, distance_m=min(MAX_DISTANCE_M, max(MIN_DISTANCE_M, distance)))

    def flown(self, right_m: float, up_m: float, forward_m: float) -> Orbit:
        """Viewer and target moved together along the view."""
        rotation = self.world_from_camera().rotation
        step = right_m * rotation[:, 0] - up_m * rotation[:, 1] + forward_m * rotation[:, 2]
        return self._shifted(step)

    def _outward(self) -> np.ndarray:
        flat = math.cos(self.pitch)
        return np.array(
            [flat * math.cos(self.yaw), flat * math.sin(self.yaw), math.sin(self.pitch)]
        )

    def _shifted(self, step: np.ndarray) -> Orbit:
        x, y, z = (float(v) for v in np.array(self.target) + step)
        return replace(self, target=(x, y, z))


def home(footprint_m: np.ndarray) -> Orbit:
    """A view of a whole room from a corner, somewhat below the ceiling's height.

    Args:
        footprint_m: (2, 2) lowest and highest floor corner.
    """
    low, high = footprint_m
    x, y = (float(v) for v in 0.5 * (low + high))
    reach = 0.5 * float(np.linalg.norm(high - low))
    return Orbit((x, y, 0.7), math.radians(-125.0), math.radians(24.0), 0.82 * reach)


def orbit_of(world_from_camera: Pose, distance_m: float) -> Orbit:
    """The orbit whose viewer is where a camera is, about a place so far ahead of it."""
    ahead = world_from_camera.rotation[:, 2]
    pitch = math.asin(max(-1.0, min(1.0, float(-ahead[2]))))
    yaw = math.atan2(-ahead[1], -ahead[0])
    x, y, z = (float(v) for v in world_from_camera.translation + distance_m * ahead)
    limited = min(MAX_PITCH, max(-MAX_PITCH, pitch))
    return Orbit((x, y, z), yaw, limited, distance_m)
