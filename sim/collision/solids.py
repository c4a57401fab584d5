"""Collision geometry of the room: the floor and the solid boxes."""

from __future__ import annotations

from scenes.mesh import PhysicalRoom
from sim.collision.contact import (
    CONTACT_TIME_S,
    FLOOR_HALF_SIZE_M,
    ROOM_FRICTION,
    STATIC_BIT,
)
from sim.engine import Spec, mujoco


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
