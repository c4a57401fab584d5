"""Virtual boxes, balls and cylinders that take part in the physics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from scenes.pose import Pose
from sim.physics.collision.contact import CONTACT_TIME_S, OBJECT_BIT, ROOM_FRICTION, STATIC_BIT
from sim.physics.engine import Spec, mujoco
from sim.physics.moving.objects import TOUCHED_BY_OBJECTS

MIN_SIZE_M = 0.01
"""Smallest side: what is smaller passes a contact within a few steps."""

ROLLING_M = 0.001
"""Resistance to rolling, as the lever of the normal force: of a ball on a hard floor."""


class Shape(Enum):
    """Kind of a primitive."""

    BOX = "box"
    SPHERE = "sphere"
    CYLINDER = "cylinder"


@dataclass(frozen=True, slots=True)
class Primitive:
    """A virtual solid.

    Attributes:
        object_id: unique among all that moves.
        shape: box, sphere or upright cylinder.
        size_m: full sides (x, y, z) of the box around it; a sphere's are equal, a cylinder's first
            two.
        world_from_object: where it begins; the origin is its centre.
        mass_kg: or None for one that never moves.
        friction: sliding friction.

    Raises:
        ValueError: a side is too small or not that of the shape, or mass or friction is not
            positive.
    """

    object_id: str
    shape: Shape
    size_m: tuple[float, float, float]
    world_from_object: Pose
    mass_kg: float | None = 1.0
    friction: float = 0.5

    def __post_init__(self) -> None:
        x, y, z = self.size_m
        if not all(math.isfinite(side) and side >= MIN_SIZE_M for side in self.size_m):
            raise ValueError(f"{self.object_id}: sides {self.size_m} m, limit {MIN_SIZE_M} m")
        if self.shape is not Shape.BOX and not math.isclose(x, y):
            raise ValueError(f"{self.object_id}: a {self.shape.value} of {x} by {y} m is not round")
        if self.shape is Shape.SPHERE and not math.isclose(x, z):
            raise ValueError(f"{self.object_id}: a sphere of {self.size_m} m is not round")
        for name, value in (("mass", self.mass_kg), ("friction", self.friction)):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{self.object_id}: {name} {value}, wanted a positive number")


def add_primitive(spec: Spec, item: Primitive, world_from_object: Pose) -> None:
    """Add a primitive as a body named by its id; free unless it has no mass."""
    is_free = item.mass_kg is not None
    body = spec.worldbody.add_body(
        name=item.object_id,
        pos=world_from_object.translation.tolist(),
        quat=world_from_object.quaternion().tolist(),
    )
    if item.mass_kg is not None:
        body.add_joint(
            name=f"{item.object_id}:free",
            type=mujoco.mjtJoint.mjJNT_FREE,
        )
    x, y, z = (0.5 * side for side in item.size_m)
    kinds = {
        Shape.BOX: (mujoco.mjtGeom.mjGEOM_BOX, [x, y, z]),
        Shape.SPHERE: (mujoco.mjtGeom.mjGEOM_SPHERE, [x, 0.0, 0.0]),
        Shape.CYLINDER: (mujoco.mjtGeom.mjGEOM_CYLINDER, [x, z, 0.0]),
    }
    kind, size = kinds[item.shape]
    body.add_geom(
        name=f"{item.object_id}:0",
        type=kind,
        size=size,
        friction=[item.friction, ROOM_FRICTION[1], ROLLING_M],
        condim=3 if item.shape is Shape.BOX else 6,
        solref=[CONTACT_TIME_S, 1.0],
        contype=OBJECT_BIT if is_free else STATIC_BIT,
        conaffinity=TOUCHED_BY_OBJECTS if is_free else 0,
        mass=item.mass_kg or 0.0,
    )
