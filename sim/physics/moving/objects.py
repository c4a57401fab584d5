"""Movable objects in the physics: free bodies made of solid boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from sim.bodies import UNIT_BOX_CORNERS
from sim.physics.collision.contact import (
    CONTACT_TIME_S,
    HAND_BIT,
    OBJECT_BIT,
    STATIC_BIT,
    TORSO_BIT,
    TRACKED_BIT,
)
from sim.physics.engine import Spec, mujoco

LOW_MASS_SHARE = 0.5
"""Share of the height of the boxes' common centre at which the centre of mass is put: legs of real
chairs are heavier than their thin backs, which boxes of one density overstate."""

TOUCHED_BY_OBJECTS = STATIC_BIT | OBJECT_BIT | HAND_BIT | TORSO_BIT | TRACKED_BIT
"""Collision bits of a free object: it collides with everything."""

DAMPING_PER_KG = 0.4
"""Resistance to motion in the air and in joints that squeak, per kg: N·s/m of the speed, and as
much of its square and its cube (SI). What is pushed on foot hardly feels the latter."""


def add_object(
    spec: Spec,
    item: PhysicalObject,
    world_from_object: Pose,
    *,
    is_tracked: bool = False,
    is_damped: bool = True,
) -> None:
    """Add an object as a body named by its id, with its origin as the object's frame.

    Args:
        spec: the model.
        item: what is added.
        world_from_object: where it begins.
        is_tracked: moved from outside (a mocap body): it pushes free objects and is stopped by
            nothing.
        is_damped: whether motion is resisted by `DAMPING_PER_KG`; never if tracked.
    """
    centre, inertia = mass_properties(item)
    body = spec.worldbody.add_body(
        name=item.object_id,
        mocap=is_tracked,
        pos=world_from_object.translation.tolist(),
        quat=world_from_object.quaternion().tolist(),
        mass=item.mass_kg,
        ipos=centre.tolist(),
        fullinertia=[
            inertia[0, 0], inertia[1, 1], inertia[2, 2],
            inertia[0, 1], inertia[0, 2], inertia[1, 2],
        ],
        explicitinertial=True,
    )  # fmt: skip
    if not is_tracked:
        body.add_joint(
            name=f"{item.object_id}:free",
            type=mujoco.mjtJoint.mjJNT_FREE,
            damping=[DAMPING_PER_KG * item.mass_kg if is_damped else 0.0] * 3,
        )
    # The frame's origin lies on the support plane, so the lowest box has to reach it.
    drop = lowest_point(item)
    for index, part in enumerate(item.parts):
        pose = part.object_from_box
        body.add_geom(
            name=f"{item.object_id}:{index}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=list(part.half_size_m),
            pos=(pose.translation - (0.0, 0.0, drop)).tolist(),
            quat=pose.quaternion().tolist(),
            friction=[item.friction, 0.002, 0.0001],
            solref=[CONTACT_TIME_S, 1.0],
            contype=TRACKED_BIT if is_tracked else OBJECT_BIT,
            conaffinity=0 if is_tracked else TOUCHED_BY_OBJECTS,
            mass=0.0,
        )


def lowest_point(item: PhysicalObject) -> float:
    """Height in the object's frame of the lowest corner of its boxes, metres."""
    return min(
        float((part.object_from_box @ (UNIT_BOX_CORNERS * part.half_size_m))[:, 2].min())
        for part in item.parts
    )


def mass_properties(item: PhysicalObject) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre of mass (3,) in the object's frame and inertia (3, 3) about it, kg·m².

    The boxes share the mass by volume; the centre is then lowered by `LOW_MASS_SHARE`.
    """
    volumes = np.array([8.0 * float(np.prod(part.half_size_m)) for part in item.parts])
    masses = item.mass_kg * volumes / volumes.sum()
    centres = np.array([part.object_from_box.translation for part in item.parts])
    centre = masses @ centres / item.mass_kg
    inertia = np.zeros((3, 3))
    for mass, part, position in zip(masses, item.parts, centres, strict=True):
        square = np.square(part.half_size_m)
        own = mass / 3.0 * np.diag(square.sum() - square)
        rotation = part.object_from_box.rotation
        offset = position - centre
        inertia += rotation @ own @ rotation.T
        inertia += mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return centre * (1.0, 1.0, LOW_MASS_SHARE), inertia
