"""Collision geometry of the room: the floor and the solid boxes."""

from __future__ import annotations

from scenes.mesh import PhysicalRoom
from sim.engine import Spec, mujoco

STATIC_BIT = 1
OBJECT_BIT = 2
HAND_BIT = 4
TORSO_BIT = 8

# MuJoCo takes the larger friction of two surfaces, so the room leaves the choice to the object.
ROOM_FRICTION = (0.05, 0.001, 0.0001)
FLOOR_HALF_SIZE_M = 20.0
CONTACT_TIME_S = 0.008
"""Time constant of a contact (four steps): a book sinks by well under a millimetre."""


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
