"""Collision geometry of the room: the floor and the solid boxes."""

from __future__ import annotations

from scenes.mesh import PhysicalRoom
from sim.physics.collision.contact import (
    CONTACT_TIME_S,
    FLOOR_HALF_SIZE_M,
    ROOM_FRICTION,
    STATIC_BIT,
)
from sim.physics.engine import Spec, mujoco

OUTSIDE_M = 0.1
"""How far behind a room's walls it is closed: within their thickness, so nothing inside is met."""
MIN_HEIGHT_M = 2.0
"""Height at which a room without walls is closed."""


def add_room(spec: Spec, room: PhysicalRoom) -> None:
    """Add the floor (z = 0) and the solids of the room to a model."""
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[FLOOR_HALF_SIZE_M, FLOOR_HALF_SIZE_M, 0.1],
        friction=list(ROOM_FRICTION),
        solref=[CONTACT_TIME_S, 1.0],
        contype=STATIC_BIT,
        conaffinity=0,
    )
    for index, solid in enumerate(room.solids):
        pose = solid.object_from_box
        spec.worldbody.add_geom(
            name=f"solid-{index}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=list(solid.half_size_m),
            pos=pose.translation.tolist(),
            quat=pose.quaternion().tolist(),
            friction=list(ROOM_FRICTION),
            solref=[CONTACT_TIME_S, 1.0],
            contype=STATIC_BIT,
            conaffinity=0,
        )


def close_room(spec: Spec, room: PhysicalRoom) -> None:
    """Add planes behind the walls and at their upper edge, so that nothing thrown gets out."""
    tops = [float(s.object_from_box.translation[2]) + s.half_size_m[2] for s in room.solids]
    height = max([MIN_HEIGHT_M, *tops])
    (x0, y0), (x1, y1) = room.footprint_m.tolist()
    sides = {
        "ceiling": ([0.0, 0.0, height], [0.0, 0.0, -1.0]),
        "west": ([x0 - OUTSIDE_M, 0.0, 0.0], [1.0, 0.0, 0.0]),
        "east": ([x1 + OUTSIDE_M, 0.0, 0.0], [-1.0, 0.0, 0.0]),
        "south": ([0.0, y0 - OUTSIDE_M, 0.0], [0.0, 1.0, 0.0]),
        "north": ([0.0, y1 + OUTSIDE_M, 0.0], [0.0, -1.0, 0.0]),
    }
    for name, (place, inwards) in sides.items():
        spec.worldbody.add_geom(
            name=f"closed-{name}",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[FLOOR_HALF_SIZE_M, FLOOR_HALF_SIZE_M, 0.1],
            pos=place,
            zaxis=inwards,
            friction=list(ROOM_FRICTION),
            solref=[CONTACT_TIME_S, 1.0],
            contype=STATIC_BIT,
            conaffinity=0,
        )
