"""Objects that only the scan knows, in the simulated room: solid where the cut found them solid.

The physical room's own objects keep their meshes, masses and friction. What was added to the scan
of it has none of these: it collides by its parts and weighs what was guessed from its size. Where
the scan missed its legs, it gets feet, so that what stood in the room can stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scenes.mesh import BoxPart, PhysicalObject, PhysicalRoom, TexturedMesh
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.prepare.cutout.object.added import ADDED
from scenes.prepare.cutout.object.solid_parts import guessed_mass_kg
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.pictures.textures import plain
from scenes.samples.shapes import OBJECT_CELL_M, box, placed
from scenes.state import ObjectModel
from sim.bodies import UNIT_BOX_CORNERS

FRICTION = 0.45
"""Of wood, felt and plastic on a floor; no picture shows it."""
GREY = (128, 128, 128)


def only_scanned(room: PhysicalRoom, scene: ScenePackage) -> tuple[ObjectModel, ...]:
    """The objects that were added to the scan of a room.

    Args:
        room: what exists.
        scene: a scan of it. What was cut out of the scan is in the room's meshes already.
    """
    known = {item.object_id for item in room.objects}
    added = {stage.name for stage in scene.stages}
    return tuple(
        item
        for item in scene.objects
        if item.object_id not in known and f"{ADDED} {item.object_id}" in added
    )


def with_scanned(room: PhysicalRoom, added: Sequence[ObjectModel]) -> PhysicalRoom:
    """The room with objects that only the scan knows; its own stay as they are."""
    return replace(room, objects=(*room.objects, *(scanned_object(item) for item in added)))


def scanned_object(item: ObjectModel) -> PhysicalObject:
    """An object as far as a scan shows it; its box where nobody has made parts of it.

    It stands on feet where the scan has missed its own; nobody sees those.
    """
    parts = item.parts or (_whole(item.box_m),)
    mass_kg = item.guessed_mass_kg or guessed_mass_kg(parts, item.box_m)
    return PhysicalObject(
        object_id=item.object_id,
        kind=item.kind,
        meshes=(_mesh(parts),),
        box_m=item.box_m,
        parts=with_feet(parts, item.box_m),
        mass_kg=mass_kg,
        friction=FRICTION,
        world_from_object=item.world_from_object,
    )


def missing(item: ObjectModel) -> str:
    """Sentence for people about what the simulation had to do without."""
    solid = f"its {len(item.parts)} solid parts" if item.parts else "the box around it"
    mass = "" if item.guessed_mass_kg else "; its mass is guessed from that box"
    return (
        f"{item.object_id}: the simulated room has no mesh of it, so the camera sees {solid} in "
        f"grey{mass}"
    )


def _whole(box_m: tuple[float, float, float]) -> BoxPart:
    x, y, z = (0.5 * side for side in box_m)
    return BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, z)), (x, y, z))


def _mesh(parts: tuple[BoxPart, ...]) -> TexturedMesh:
    """The parts' surfaces, grey: colours of the splats would show the tracker its own model."""
    surfaces = [
        surface
        for part in parts
        for surface in placed(
            box(
                (-np.array(part.half_size_m)).tolist(),
                part.half_size_m,
                material=plain(GREY),
                cell_m=OBJECT_CELL_M,
            ),
            part.object_from_box,
        )
    ]
    return mesh_from_surfaces(surfaces, width_px=1024)


GROUND_M = 0.003
"""Height below which a part reaches the ground: what the cut's cells round to."""
OUT_SHARE = 0.7
"""Share of half the box at which a corner has to be carried: legs stand a little inwards."""
FOOT_SHARE = 0.12
"""Side of a foot as a share of the box's shorter side."""
TALLEST_SHARE = 0.5
"""Height of a foot as a share of the box's: a foot that stands alone carries as well."""


def with_feet(parts: Sequence[BoxPart], box_m: tuple[float, float, float]) -> tuple[BoxPart, ...]:
    """The parts, and a foot in each corner in which none of them reaches the ground.

    Args:
        parts: solid boxes in the object's frame, whose ground is z = 0.
        box_m: extents of the object, metres.
    """
    bounds = [
        part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m)) for part in parts
    ]
    low = np.array([corners.min(axis=0) for corners in bounds])
    high = np.array([corners.max(axis=0) for corners in bounds])
    feet: list[BoxPart] = []
    out = OUT_SHARE * 0.5 * np.asarray(box_m[:2])
    side = FOOT_SHARE * min(box_m[:2])
    for sign in ((-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)):
        signs = np.array(sign)
        reach = np.where(signs > 0.0, high[:, :2], -low[:, :2])
        is_carried = (reach >= out).all(axis=1) & (low[:, 2] < GROUND_M)
        if is_carried.any():
            continue
        there = (reach > 0.0).all(axis=1)
        above = float(low[there, 2].min()) if there.any() else 0.0
        height = float(np.clip(above, 2.0 * GROUND_M, TALLEST_SHARE * box_m[2]))
        x, y = signs * (out + 0.5 * side)
        half = (0.5 * side, 0.5 * side, 0.5 * height)
        feet.append(BoxPart(Pose.from_yaw(0.0, (x, y, 0.5 * height)), half))
    return (*parts, *feet)
