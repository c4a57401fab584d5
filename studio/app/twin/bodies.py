"""Virtual bodies of the document as physics has them: with a mass, their origin in the middle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scenes.pose import Pose
from studio.app.model.documents.document import Primitive

if TYPE_CHECKING:
    from sim.physics.moving.primitives import Primitive as Solid

DENSITY_KG_PER_M3 = 150.0
"""Of a body that was added by hand: a moving box with something in it, light wooden furniture."""


def solid_of(item: Primitive) -> Solid:
    """A primitive of the document for the physics."""
    from sim.physics.moving.primitives import Primitive as Solid
    from sim.physics.moving.primitives import Shape

    shapes = {"box": Shape.BOX, "ball": Shape.SPHERE, "cylinder": Shape.CYLINDER}
    return Solid(
        object_id=item.primitive_id,
        shape=shapes[item.shape],
        size_m=item.size_m,
        world_from_object=world_from_centre(item),
        mass_kg=mass_kg(item),
    )


def mass_kg(item: Primitive) -> float:
    """What a body weighs, by its volume."""
    x, y, z = item.size_m
    share = {"box": 1.0, "ball": math.pi / 6.0, "cylinder": math.pi / 4.0}[item.shape]
    return DENSITY_KG_PER_M3 * share * x * y * z


def world_from_centre(item: Primitive) -> Pose:
    """Pose of a body's middle."""
    return item.world_from_primitive @ _base_from_centre(item)


def world_from_base(item: Primitive, world_from_middle: Pose) -> Pose:
    """Pose of a body's base, as the document has it, from its middle's."""
    return world_from_middle @ _base_from_centre(item).inverse()


def _base_from_centre(item: Primitive) -> Pose:
    return Pose.from_yaw(0.0, (0.0, 0.0, 0.5 * item.size_m[2]))
