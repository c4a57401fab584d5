"""Walking at head height: where a visitor may stand, and how walls turn them aside."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.streams import Slot
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.workers.task import Task

if TYPE_CHECKING:
    from scenes.package import ScenePackage
    from sim.navigation.floor import FreeFloor

EYES_M = 1.65
"""Height of a standing visitor's eyes, metres: the mean of adults."""

MAX_PITCH = math.radians(80.0)
TURN_PER_PX = math.radians(0.25)


class FoundFloor:
    """The floor on which one walks in a scene, found on a thread: a large mesh takes a second."""

    def __init__(self) -> None:
        self._scene: ScenePackage | None = None
        self._found: Slot[tuple[ScenePackage, FreeFloor]] = Slot()
        self._floor: FreeFloor | None = None

    def find(self, scene: ScenePackage | None) -> None:
        """Begin to find a scene's floor, unless that has been done."""
        if scene is None or scene is self._scene:
            return
        self._scene, self._floor, found = scene, None, self._found

        def run(_task: Task[None]) -> None:
            from studio.app.viewport.visitor_floor import visitor_floor  # takes a while to import

            found.put((scene, visitor_floor(scene)))

        Task("floor", run).start()

    def of(self, scene: ScenePackage | None) -> FreeFloor | None:
        """A scene's floor; None before it is found."""
        found = self._found.take()
        if found is not None and found[0] is self._scene:
            self._floor = found[1]
        return self._floor if scene is self._scene else None


@dataclass(frozen=True, slots=True)
class Walker:
    """A visitor on the floor.

    Attributes:
        x, y: where they stand, world metres.
        yaw: where they look, from world x, anticlockwise, radians.
        pitch: above the horizon, radians.
    """

    x: float
    y: float
    yaw: float
    pitch: float = 0.0

    def world_from_camera(self) -> Pose:
        """The eyes' pose."""
        flat = math.cos(self.pitch)
        eye = np.array([self.x, self.y, EYES_M])
        ahead = np.array(
            [flat * math.cos(self.yaw), flat * math.sin(self.yaw), math.sin(self.pitch)]
        )
        return look_at(eye, eye + ahead)

    def turned(self, dx_px: float, dy_px: float) -> Walker:
        """After a drag of so many pixels: the room follows the mouse."""
        pitch = min(MAX_PITCH, max(-MAX_PITCH, self.pitch + TURN_PER_PX * dy_px))
        return replace(self, yaw=self.yaw + TURN_PER_PX * dx_px, pitch=pitch)

    def walked(self, right_m: float, ahead_m: float, floor: FreeFloor | None) -> Walker:
        """After a step; where it is blocked, along whichever axis is free.

        Args:
            right_m: to the right.
            ahead_m: where they look, on the floor.
            floor: where one may stand; None lets them walk anywhere.
        """
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = ahead_m * c + right_m * s, ahead_m * s - right_m * c
        for step in ((dx, dy), (dx, 0.0), (0.0, dy)):
            if step != (0.0, 0.0) and _is_free(floor, self.x + step[0], self.y + step[1]):
                return replace(self, x=self.x + step[0], y=self.y + step[1])
        return self

    def stood_at(self, point: NDArray[np.float64], floor: FreeFloor | None) -> Walker:
        """After a jump to a place on the floor, or the free place nearest to it."""
        place = np.asarray(point, dtype=np.float64)[:2]
        if floor is not None and not _is_free(floor, *place):
            place = floor.nearest_free(place)
        return replace(self, x=float(place[0]), y=float(place[1]))


def walker_from(world_from_camera: Pose, floor: FreeFloor | None) -> Walker:
    """A visitor who looks where a camera looks, at the free place nearest to it."""
    ahead = world_from_camera.rotation[:, 2]
    yaw = math.atan2(ahead[1], ahead[0])
    return Walker(0.0, 0.0, yaw).stood_at(world_from_camera.translation, floor)


def _is_free(floor: FreeFloor | None, x: float, y: float) -> bool:
    if floor is None:
        return True
    row, column = floor.cell(np.array([x, y]))
    rows, columns = floor.free.shape
    return 0 <= row < rows and 0 <= column < columns and bool(floor.free[row, column])
