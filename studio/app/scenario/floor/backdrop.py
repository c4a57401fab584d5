"""Opens on a thread what the floor plan shows: the room, its first scenario, its picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.streams import BoundedQueue
from scenes.package import ScenePackage
from scenes.workers.task import Task
from studio.app.scenario.plan import RoomPlan, room_plan

PICTURE_PX = 640
"""Side of the picture from above: twice a dock's width."""


@dataclass(frozen=True, slots=True, eq=False)
class Backdrop:
    """Findings of a thread about a scene; what is missing is None or empty.

    Attributes:
        scene: whose.
        plan: of its floor.
        picture: (S, S, 3) RGB from above, north up.
        extent_m: side of the picture on the floor, metres.
        first_text: the scenario that a scanned room begins with.
        problem: why something is missing.
    """

    scene: ScenePackage
    plan: RoomPlan | None = None
    picture: NDArray[np.uint8] | None = None
    extent_m: float = 0.0
    first_text: str = ""
    problem: str = ""


class BackdropJob:
    """Works on one scene; what it finds is taken by the window's timer.

    Args:
        scene: what is open.
        name: by which it was opened.
    """

    def __init__(self, scene: ScenePackage, name: str) -> None:
        self.scene = scene
        self._name = name
        self._found: BoundedQueue[Backdrop] = BoundedQueue(4, name="backdrop")
        self._task = Task("floor plan", self._run)
        self._task.start()

    def take(self) -> Backdrop | None:
        """Return the findings since the last call."""
        return self._found.take()

    @property
    def is_done(self) -> bool:
        """Whether nothing more comes."""
        return not self._task.is_running

    def _run(self, _task: Task[None]) -> None:
        try:
            self._found.put(Backdrop(self.scene, plan=self._plan()))
            self._found.put(self._picture())
            if self.scene.physical is None:
                self._found.put(self._first())
        except Exception as error:  # noqa: BLE001 - said in the window, which goes on without
            self._found.put(Backdrop(self.scene, problem=str(error) or type(error).__name__))

    def _plan(self) -> RoomPlan:
        from scenes.samples import sample_room
        from sim.physics.scanned.objects import only_scanned, with_scanned

        if self.scene.physical is None:
            return room_plan(self.scene, None)
        room = sample_room(self.scene.physical)
        return room_plan(self.scene, with_scanned(room, only_scanned(room, self.scene)))

    def _picture(self) -> Backdrop:
        from scenes.render.native import NativeRenderer
        from studio.view.twin import MARGIN_M, Twin

        picture = Twin(self.scene, NativeRenderer()).picture_from_above({}, PICTURE_PX)
        low, high = self.scene.footprint_m
        extent_m = float((high - low).max()) + 2 * MARGIN_M
        return Backdrop(self.scene, picture=picture, extent_m=extent_m)

    def _first(self) -> Backdrop:
        from studio.session.staging import staging_of

        staging = staging_of(self._name, None)
        plan = room_plan(self.scene, staging.room)
        return Backdrop(self.scene, plan=plan, first_text=staging.scenario_text)
