"""Bodies that exist in the physics of a room alone: primitives and objects."""

from __future__ import annotations

from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from sim.physics.engine import Spec
from sim.physics.moving.objects import add_object
from sim.physics.moving.primitives import Primitive, add_primitive

Virtual = Primitive | PhysicalObject
"""A primitive's origin is its centre, an object's lies on the plane it stands on."""


def add_virtual(spec: Spec, item: Virtual, world_from_object: Pose) -> None:
    """Add a virtual object as a body named by its id; only the air slows it."""
    if isinstance(item, Primitive):
        add_primitive(spec, item, world_from_object)
    else:
        add_object(spec, item, world_from_object, is_damped=False)


def size_m(item: Virtual) -> tuple[float, float, float]:
    """Full sides (x, y, z) of the box around it, metres."""
    return item.size_m if isinstance(item, Primitive) else item.box_m
