"""Bodies and meshes of the document as the physics has them: solid, with a mass."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from scenes.pose import Pose, rotation_angle
from studio.app.model.documents.added_mesh import AddedMesh
from studio.app.model.documents.arranged import LARGEST_MESH_M, mass_kg
from studio.app.model.documents.document import Primitive, TwinEdits

if TYPE_CHECKING:
    from scenes.mesh import PhysicalObject
    from sim.physics.moving.primitives import Primitive as Solid
    from sim.physics.moving.virtual import Virtual

MIN_SIDE_M = 0.01
"""Thickness that a flat mesh gets in the physics, as the thinnest primitive there may be."""

MOVED_M = 0.005
"""Way below which an object that nobody gripped counts as where it was: a scan's noise lets
objects settle by as much."""
MOVED_RAD = math.radians(1.0)
"""Turn below which it does."""

Body = Primitive | AddedMesh


def bodies_of(twin: TwinEdits) -> dict[str, Body]:
    """Return the document's items that the physics has, by id."""
    small = {key: mesh for key, mesh in twin.meshes.items() if max(mesh.size_m) <= LARGEST_MESH_M}
    return {**twin.primitives, **small}


def is_same_body(first: Body, second: Body) -> bool:
    """Whether two differ in nothing but their pose."""
    if isinstance(first, Primitive) and isinstance(second, Primitive):
        return (first.shape, first.size_m) == (second.shape, second.size_m)
    if isinstance(first, AddedMesh) and isinstance(second, AddedMesh):
        return first.geometry is second.geometry and first.scale == second.scale
    return False


def virtual_of(item: Body) -> Virtual:
    """A body for the physics; of a large mesh this takes some tenths of a second."""
    return solid_of(item) if isinstance(item, Primitive) else _object_of(item)


def physical_pose(item: Body) -> Pose:
    """Return a body's pose in the physics: of a primitive its middle, of a mesh its base."""
    if isinstance(item, Primitive):
        return item.world_from_primitive @ _base_from_centre(item)
    return item.world_from_mesh


def base_pose(item: Body, world_from_physical: Pose) -> Pose:
    """Pose of a body's base, as the document has it, from where the physics has it."""
    if isinstance(item, Primitive):
        return world_from_physical @ _base_from_centre(item).inverse()
    return world_from_physical


def solid_of(item: Primitive) -> Solid:
    """A primitive of the document for the physics."""
    from sim.physics.moving.primitives import Primitive as Solid
    from sim.physics.moving.primitives import Shape

    shapes = {"box": Shape.BOX, "ball": Shape.SPHERE, "cylinder": Shape.CYLINDER}
    return Solid(
        object_id=item.primitive_id,
        shape=shapes[item.shape],
        size_m=item.size_m,
        world_from_object=physical_pose(item),
        mass_kg=mass_kg(item),
    )


def _object_of(item: AddedMesh) -> PhysicalObject:
    """A mesh as boxes, as heavy as such boxes usually are."""
    from scenes.mesh import PhysicalObject
    from scenes.prepare.cutout.object.solid_parts import guessed_mass_kg
    from sim.physics.scanned.objects import FRICTION
    from sim.scenarios.arrangement import parts_of_mesh

    x, y, z = (max(side, MIN_SIDE_M) for side in item.size_m)
    parts = parts_of_mesh(item.scaled)
    return PhysicalObject(
        object_id=item.mesh_id,
        kind="mesh",
        meshes=(),
        box_m=(x, y, z),
        parts=parts,
        mass_kg=guessed_mass_kg(parts, (x, y, z)),
        friction=FRICTION,
        world_from_object=item.world_from_mesh,
    )


def _base_from_centre(item: Primitive) -> Pose:
    return Pose.from_yaw(0.0, (0.0, 0.0, 0.5 * item.size_m[2]))


def is_same_pose(world_from_a: Pose, world_from_b: Pose) -> bool:
    """Whether two poses differ by rounding at most."""
    if world_from_a is world_from_b:
        return True
    return bool(np.abs(world_from_a.matrix() - world_from_b.matrix()).max() < 1e-9)


def has_moved(world_from_before: Pose, world_from_after: Pose, share: float) -> bool:
    """Whether a body has moved or turned by more than a share of `MOVED_M` or `MOVED_RAD`."""
    way = float(np.linalg.norm(world_from_after.translation - world_from_before.translation))
    turn = rotation_angle(world_from_after.rotation @ world_from_before.rotation.T)
    return way > share * MOVED_M or turn > share * MOVED_RAD
