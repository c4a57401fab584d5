"""Bodies that move before the simulated camera: surfaces, and solids that cast their shadow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject, TexturedMesh
from scenes.pose import Pose

UNIT_BOX_CORNERS = np.array(
    [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
)


@dataclass(frozen=True, slots=True, eq=False)
class BodyPart:
    """A rigid piece of a body.

    Attributes:
        meshes: surfaces in the part's frame; textures are albedo.
        solids: convex point sets (N, 3) in the part's frame whose hulls cast the shadow.
    """

    meshes: tuple[TexturedMesh, ...]
    solids: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A movable object or a person, made of rigid parts.

    Attributes:
        body_id: unique among the bodies.
        parts: an object has one, a person one a limb.
    """

    body_id: str
    parts: tuple[BodyPart, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Place of a body in one frame.

    Attributes:
        world_from_part: one pose per part of the body.
        support_z_m: height of the surface that takes its shadow, world metres.
    """

    world_from_part: tuple[Pose, ...]
    support_z_m: float


def body_of_object(item: PhysicalObject) -> Body:
    """The drawable body of a movable object: one part in the object's frame."""
    solids = tuple(
        part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m))
        for part in item.parts
    )
    return Body(item.object_id, (BodyPart(item.meshes, solids),))


def solids_in_world(body: Body, placement: Placement) -> Sequence[NDArray[np.float64]]:
    """The body's convex point sets (N, 3) in world metres."""
    return [
        world_from_part @ solid
        for part, world_from_part in zip(body.parts, placement.world_from_part, strict=True)
        for solid in part.solids
    ]
