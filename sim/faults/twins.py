"""Identical copies of a movable object, which the scan of the room does not know."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from sim.faults.fault import Fault, Stage, misfit_of_object
from sim.tables import Table

MAX_TWINS = 8
"""Copies in one row; more than fits into any of the built-in rooms."""

ROW_M = (0.8, 0.0)
"""From one copy of a row to the next, (x, y) metres: chairs stand free."""


@dataclass(frozen=True, slots=True)
class Twins(Fault):
    """A row of copies. They are pushed and seen as any object, and nobody tracks them.

    Attributes:
        object: whose copies.
        at: (x, y) of the first, metres; it stands at the height of the object.
        count: how many.
        yaw_deg: of all, anticlockwise.
        step: (x, y) from one copy to the next, metres.
    """

    name: ClassVar[str] = "twins"
    sizes: ClassVar[Mapping[str, str]] = {"count": "copies"}

    object: str
    at: tuple[float, float]
    count: int = 1
    yaw_deg: float = 0.0
    step: tuple[float, float] = ROW_M

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(
            table.text("object"),
            table.point("at"),
            table.integer("count", 1, low=0, high=MAX_TWINS),
            table.number("yaw_deg", 0.0, low=-360.0, high=360.0),
            table.optional_point("step") or ROW_M,
        )
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        del t_s
        return float(self.count)

    def described(self) -> str:
        """See `Fault.described`."""
        return f"{self.count} unscanned twins of {self.object} stand in the room"

    def misfit(self, stage: Stage) -> tuple[str, object, str] | None:
        """See `Fault.misfit`: the object must exist, and all copies must be in the room."""
        wrong = misfit_of_object("object", self.object, stage)
        if wrong is not None:
            return wrong
        low, high = np.array(stage.low), np.array(stage.high)
        for place in self.places():
            if not (low < place).all() or not (place < high).all():
                return (
                    "at",
                    place.tolist(),
                    f"copies inside the room: x {low[0]:g}..{high[0]:g}, y {low[1]:g}..{high[1]:g}",
                )
        return None

    def places(self) -> list[np.ndarray[tuple[int], np.dtype[np.float64]]]:
        """(2,) of each copy, world metres."""
        return [np.asarray(self.at) + k * np.asarray(self.step) for k in range(self.count)]


def with_twins(room: PhysicalRoom, twins: Sequence[Twins]) -> PhysicalRoom:
    """The room with the copies among its objects, as `OBJECT:twin-K`, after all others."""
    if not twins:
        return room
    added: list[PhysicalObject] = []
    for row in twins:
        original = room.object_by_id(row.object)
        height_m = float(original.world_from_object.translation[2])
        for x, y in row.places():
            pose = Pose.from_yaw(np.radians(row.yaw_deg), (x, y, height_m))
            name = f"{row.object}:twin-{1 + len(added)}"
            added.append(replace(original, object_id=name, world_from_object=pose))
    return replace(room, objects=(*room.objects, *added))
