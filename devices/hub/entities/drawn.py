"""An entity that somebody has put into the room, on the wire and in the session's axes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.hub.roles import Op
from scenes.frames import WORLD_FROM_GLTF
from scenes.pose import Pose
from scenes.state import (
    Annotation,
    LiveSurface,
    Placed,
    PrimitiveShape,
    Proposal,
    SceneState,
    SharedPrimitive,
)

DECIMALS = 4
"""Places after the point on the wire: a tenth of a millimetre."""

QUATERNION_DECIMALS = 5
"""Of a quaternion on the wire: 2e-5 rad, less than a tenth of a millimetre across a room."""

SURFACE_PX = 1024
"""Longer side of the rectified picture that a new surface asks for, pixels."""

GLTF_FROM_WORLD = WORLD_FROM_GLTF.inverse()
"""From the session's axes to those of the wire."""

ROOM = "room"
"""Author of what the session itself has drawn."""

NOTHING = np.zeros((0, 3))
"""Points of what is erased."""

AT_ORIGIN = Pose.identity()
"""Pose of what has none."""

Entity = Annotation | LiveSurface | Placed
"""An entity in the session's types."""


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """An entity as it is on the wire.

    Attributes:
        op: line, surface, primitive or propose.
        key: unique in the session.
        by: person whose it is, or "room".
        points: (N, 3) metres, y up: of a line, or corners of a surface; none where it is erased.
        colour: of a line or primitive.
        seen: (4, 3) corners to which a surface is carried, or (0, 3).
        shape: of a primitive; None where it is erased.
        size_m: of a primitive, along its own axes, y up.
        room_from_entity: of a primitive or proposal, or of the object on which a line was begun;
            room and entity with y up.
        object_id: of a proposal, empty where it is withdrawn; with which a line goes, empty where
            it stays.
        name: of a proposal's owner.
    """

    op: Op
    key: str
    by: str
    points: NDArray[np.float64] = field(default_factory=lambda: NOTHING)
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    seen: NDArray[np.float64] = field(default_factory=lambda: NOTHING)
    shape: PrimitiveShape | None = None
    size_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    room_from_entity: Pose = AT_ORIGIN
    object_id: str = ""
    name: str = ""

    @property
    def is_there(self) -> bool:
        """Whether it is in the room, rather than the end of what was."""
        if self.op is Op.PRIMITIVE:
            return self.shape is not None
        return bool(self.object_id) if self.op is Op.PROPOSE else len(self.points) > 0

    @property
    def is_finite(self) -> bool:
        """Whether it is somewhere: every number of its place can be sent."""
        numbers = (*self.points.flat, *self.seen.flat, *self.size_m)
        return bool(
            np.isfinite(numbers).all() and np.isfinite(self.room_from_entity.matrix()).all()
        )

    def entry(self) -> dict[str, Any]:
        """Return its fields in the log."""
        return {"by": self.by, "op": str(self.op), FIELDS[self.op]: self.key, **self.fields()}

    def fields(self) -> dict[str, Any]:
        """Return what is said of it beside whose and which it is."""
        colour = [round(part, DECIMALS) for part in self.colour]
        match self.op:
            case Op.SURFACE:
                seen = {"seen": _listed(self.seen)} if len(self.seen) else {}
                return {"corners": _listed(self.points), **seen}
            case Op.PRIMITIVE:
                if self.shape is None:
                    return {"shape": None}
                size = [round(side, DECIMALS) for side in self.size_m]
                pose = on_the_wire(self.room_from_entity)
                return {"shape": self.shape, "size": size, "colour": colour, "pose": pose}
            case Op.PROPOSE:
                if not self.object_id:
                    return {"object": None}
                pose = on_the_wire(self.room_from_entity)
                return {"name": self.name, "object": self.object_id, "pose": pose}
            case _:
                line = {"points": _listed(self.points), "colour": colour}
                on = {"on": self.object_id, "at": on_the_wire(self.room_from_entity)}
                return line | (on if self.object_id else {})

    def entity(self) -> Entity:
        """Return it in the session's types and axes."""
        match self.op:
            case Op.SURFACE:
                return self._surface()
            case Op.PRIMITIVE:
                x, y, z = self.size_m
                pose = _in_world(self.room_from_entity)
                return SharedPrimitive(self.key, self.by, self.shape, (x, z, y), self.colour, pose)
            case Op.PROPOSE:
                pose = _in_world(self.room_from_entity)
                return Proposal(self.key, self.by, self.name, self.object_id, pose)
            case _:
                points = WORLD_FROM_GLTF @ self.points
                line = Annotation(self.key, self.by, points, self.colour)
                if not self.object_id:
                    return line
                at = _in_world(self.room_from_entity)
                return replace(line, object_id=self.object_id, world_from_object=at)

    def _surface(self) -> LiveSurface:
        """Return a surface whose picture is as large as its shape asks for."""
        corners = WORLD_FROM_GLTF @ self.points
        size_px = (SURFACE_PX, SURFACE_PX)
        if len(corners):
            sides = np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1)
            width, height = float(sides[0] + sides[2]), float(sides[1] + sides[3])
            scale = SURFACE_PX / max(width, height, 1e-6)
            size_px = (max(16, round(scale * width)), max(16, round(scale * height)))
        carried = WORLD_FROM_GLTF @ self.seen if len(self.seen) else None
        return LiveSurface(self.key, corners, size_px, "", carried)


FIELDS = {
    Op.LINE: "line",
    Op.SURFACE: "surface",
    Op.PRIMITIVE: "primitive",
    Op.PROPOSE: "proposal",
}
"""Fields with an entity's name, by operation."""


def drawn_entity(entity: Entity) -> Drawn:
    """Return an entity of the session as it is on the wire; lines and surfaces are the room's."""
    match entity:
        case Annotation():
            points = GLTF_FROM_WORLD @ np.asarray(entity.points_in_world, dtype=np.float64)
            red, green, blue = (float(part) for part in entity.colour)
            points = points.reshape(-1, 3)
            drawn = Drawn(Op.LINE, entity.annotation_id, ROOM, points, (red, green, blue))
            if entity.world_from_object is None:
                return drawn
            at = _in_gltf(entity.world_from_object)
            return replace(drawn, object_id=entity.object_id, room_from_entity=at)
        case LiveSurface():
            corners = GLTF_FROM_WORLD @ np.asarray(entity.corners_in_world, dtype=np.float64)
            carried = entity.carried_to
            seen = NOTHING if carried is None else GLTF_FROM_WORLD @ carried
            return Drawn(Op.SURFACE, entity.surface_id, ROOM, corners.reshape(-1, 3), seen=seen)
        case SharedPrimitive():
            x, y, z = entity.size_m
            return Drawn(
                Op.PRIMITIVE,
                entity.primitive_id,
                entity.user_id or ROOM,
                colour=entity.colour,
                shape=entity.shape,
                size_m=(x, z, y),
                room_from_entity=_in_gltf(entity.world_from_primitive),
            )
        case Proposal():
            return Drawn(
                Op.PROPOSE,
                entity.proposal_id,
                entity.user_id or ROOM,
                room_from_entity=_in_gltf(entity.world_from_object),
                object_id=entity.object_id,
                name=entity.user_name,
            )


def drawn_by_room(
    before: SceneState, state: SceneState, *, is_known: Callable[[tuple[Op, str], Entity], bool]
) -> Iterator[Drawn]:
    """Yield entities in which two states differ; one that is gone as its end.

    Args:
        before: the state before.
        state: the next one.
        is_known: whether a value of that operation and name has come from the people themselves.
    """
    for op, old, new in (
        (Op.LINE, before.annotations, state.annotations),
        (Op.SURFACE, before.surfaces, state.surfaces),
        (Op.PRIMITIVE, before.primitives, state.primitives),
        (Op.PROPOSE, before.proposals, state.proposals),
    ):
        if old is new:
            continue
        for key, entity in new.items():
            if old.get(key) is not entity and not is_known((op, key), entity):
                yield drawn_entity(entity)
        for key in old.keys() - new.keys():
            yield Drawn(op, key, ROOM)


def on_the_wire(room_from_entity: Pose) -> list[float]:
    """Return place and quaternion x y z w."""
    w, x, y, z = (round(float(part), QUATERNION_DECIMALS) for part in room_from_entity.quaternion())
    place = [round(float(part), DECIMALS) for part in room_from_entity.translation]
    return [*place, x, y, z, w]


def _in_world(room_from_entity: Pose) -> Pose:
    """Return a pose whose axes of room and entity have z up, from one where y is up."""
    return WORLD_FROM_GLTF @ room_from_entity @ GLTF_FROM_WORLD


def _in_gltf(world_from_thing: Pose) -> Pose:
    return GLTF_FROM_WORLD @ world_from_thing @ WORLD_FROM_GLTF


def _listed(points: NDArray[np.float64]) -> list[list[float]]:
    return np.round(points, DECIMALS).tolist()
