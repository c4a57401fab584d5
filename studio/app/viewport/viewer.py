"""Viewpoint of one view: orbiting, walking, or through somebody's eyes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from scenes.frames import look_at
from scenes.pose import Pose
from studio.app.viewport.orbit import Orbit, orbit_of
from studio.app.viewport.walk import Walker, walker_from

if TYPE_CHECKING:
    from sim.navigation.floor import FreeFloor

Mode = Literal["orbit", "fly", "walk"]
MODES: tuple[Mode, ...] = ("orbit", "fly", "walk")

STEP_M = 0.12
"""Of flight and walk at every press of a key, metres: some 1.2 m/s with the keys' repetition."""

OBJECT_EYES_M = 0.15
"""How far above its top an object's view is taken, metres: clear of its own splats."""


@dataclass(frozen=True, slots=True)
class Viewer:
    """A viewer of the room.

    Attributes:
        orbit: where they are while they orbit or fly.
        walker: where they are while they walk.
        mode: which of both.
    """

    orbit: Orbit
    walker: Walker
    mode: Mode = "orbit"

    def world_from_camera(self) -> Pose:
        """Their eyes' pose."""
        return (self.walker if self.mode == "walk" else self.orbit).world_from_camera()

    def dragged(self, dx_px: float, dy_px: float) -> Viewer:
        """After a left drag: turned."""
        if self.mode == "walk":
            return replace(self, walker=self.walker.turned(dx_px, dy_px))
        if self.mode == "fly":
            return replace(self, orbit=self.orbit.looked(dx_px, dy_px))
        return replace(self, orbit=self.orbit.turned(dx_px, dy_px))

    def stepped(self, right: float, up: float, ahead: float, *, floor: FreeFloor | None) -> Viewer:
        """After a press of the flight keys, in steps of `STEP_M`."""
        if self.mode == "walk":
            walker = self.walker.walked(STEP_M * right, STEP_M * ahead, floor)
            return replace(self, walker=walker)
        return replace(self, orbit=self.orbit.flown(STEP_M * right, STEP_M * up, STEP_M * ahead))

    def in_mode(self, mode: Mode, floor: FreeFloor | None) -> Viewer:
        """The same view, moved in another way; walking begins on the floor below it."""
        if mode == self.mode:
            return self
        here = self.world_from_camera()
        if mode == "walk":
            return replace(self, mode=mode, walker=walker_from(here, floor))
        orbit = orbit_of(here, self.orbit.distance_m if self.mode != "walk" else 2.0)
        return replace(self, mode=mode, orbit=orbit)

    def about(self, point: NDArray[np.float64]) -> Viewer:
        """Turn about a place from now on, from where they are."""
        eye = self.world_from_camera().translation
        away = float(np.linalg.norm(point - eye))
        if self.mode == "walk" or away < 0.05:
            return self
        outward = (eye - point) / away
        x, y, z = (float(v) for v in point)
        yaw, pitch = float(np.arctan2(outward[1], outward[0])), float(np.arcsin(outward[2]))
        return replace(self, orbit=Orbit((x, y, z), yaw, pitch, away))

    def framed(self, centre: NDArray[np.float64], radius_m: float) -> Viewer:
        """Something of that size fills half of the view."""
        x, y, z = (float(v) for v in centre)
        orbit = replace(self.orbit, target=(x, y, z), distance_m=max(0.4, 3.0 * radius_m))
        return replace(self, orbit=orbit, mode="orbit" if self.mode == "walk" else self.mode)


def object_eyes(world_from_object: Pose, height_m: float) -> Pose:
    """Return the eyes of an object: ahead along its +x, from above its top."""
    eye = world_from_object @ np.array([0.0, 0.0, height_m + OBJECT_EYES_M])
    return look_at(eye, eye + world_from_object.rotation @ np.array([1.0, 0.0, -0.2]))
