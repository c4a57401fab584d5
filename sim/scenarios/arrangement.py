"""Arranged by hand before a session begins: objects elsewhere, bodies put into the room.

In a scenario's file these are the tables `arranged` and `added`. Of several with one id, the last
one counts: whoever arranges a room anew adds to the file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.coloured_mesh import Geometry, unpacked
from scenes.mesh import BoxPart, PhysicalObject, PhysicalRoom, TexturedMesh
from scenes.package import ScenePackage
from scenes.pose import Pose, rotation_from_vector
from scenes.state import ObjectModel
from sim.physics.scanned.objects import FRICTION
from sim.tables import Table

FARTHEST_M = 1000.0
"""Distance from the world's origin up to which something can be put: no room is larger."""
MAX_SIDE_M, MIN_SIDE_M = 100.0, 0.01
"""Limits of a body's sides: the thinnest that contacts hold, and larger than any room."""
MAX_MASS_KG, MIN_MASS_KG = 1e6, 1e-6
"""Limits of a body's mass."""
ROUND_SIDES = 32
"""Faces around a cylinder and a ball as the camera sees them: no corner shows at two metres."""


@dataclass(frozen=True, slots=True)
class Arrangement:
    """The differences from the scan when the session begins.

    Attributes:
        poses: `world_from_object` of objects of the room, by id.
        added: what stands in the room beside what was scanned.
    """

    poses: Mapping[str, Pose] = field(default_factory=lambda: MappingProxyType({}), hash=False)
    added: tuple[PhysicalObject, ...] = ()

    def pose_of(self, item: PhysicalObject | ObjectModel) -> Pose:
        """Pose that an object begins with: `world_from_object`."""
        return self.poses.get(item.object_id, item.world_from_object)


def read_arrangement(table: Table) -> Arrangement:
    """The tables `arranged` and `added` of a scenario's file.

    Raises:
        ScenarioError: a key or value is wrong.
    """
    poses: dict[str, Pose] = {}
    for row in table.tables("arranged"):
        poses[row.text("id")] = _pose(row)
        row.done()
    added = {item.object_id: item for item in map(_added, table.tables("added"))}
    return Arrangement(MappingProxyType(poses), tuple(added.values()))


def arranged_room(room: PhysicalRoom, arrangement: Arrangement) -> PhysicalRoom:
    """The room as it was arranged; objects that it does not have stay out of it."""
    objects = [
        replace(
            item, world_from_object=arrangement.poses.get(item.object_id, item.world_from_object)
        )
        for item in room.objects
    ]
    return replace(room, objects=(*objects, *arrangement.added))


def arranged_scene(scene: ScenePackage, arrangement: Arrangement) -> ScenePackage:
    """The scan with its objects where they were put; what was added is in no scan."""
    if not arrangement.poses:
        return scene
    objects = tuple(
        replace(
            item, world_from_object=arrangement.poses.get(item.object_id, item.world_from_object)
        )
        for item in scene.objects
    )
    return replace(scene, objects=objects)


def _added(row: Table) -> PhysicalObject:
    name, shape = row.text("id"), row.text("shape")
    if shape not in ("box", "ball", "cylinder", "mesh"):
        raise row.error("shape", shape, "box, ball, cylinder or mesh")
    mass_kg = row.number("mass_kg", low=MIN_MASS_KG, high=MAX_MASS_KG)
    pose = _pose(row)
    if shape == "mesh":
        row.optional_text("source")
        try:
            geometry = unpacked(
                row.text("triangles"),
                vertex_count=row.integer("vertices", low=1, high=10**7),
                face_count=row.integer("faces", low=1, high=10**7),
            )
        except ValueError as error:
            raise row.error("triangles", "…", f"a mesh: {error}") from None
        size, parts = _sides(geometry.size_m), parts_of_mesh(geometry)
        meshes: tuple[TexturedMesh, ...] = (_drawn_mesh(geometry),)
    else:
        asked = row.optional_point3("size_m")
        if asked is None or min(asked) < MIN_SIDE_M or max(asked) > MAX_SIDE_M:
            raise row.error("size_m", asked, f"[x, y, z] of {MIN_SIDE_M:g} to {MAX_SIDE_M:g} m")
        size, parts = asked, _parts(shape, asked)
        colour = row.optional_point3("colour") or (0.5, 0.5, 0.5)
        meshes = (_drawn_shape(shape, size, colour),)
    row.done()
    return PhysicalObject(name, shape, meshes, size, parts, mass_kg, FRICTION, pose)


def parts_of_mesh(geometry: Geometry) -> tuple[BoxPart, ...]:
    """A mesh as boxes; this takes some tenths of a second."""
    import trimesh

    from scenes.prepare.cutout.object.solid_parts import solid_parts_of_surface

    shell = trimesh.Trimesh(geometry.vertices, geometry.faces, process=False)
    sampling: Any = trimesh.sample
    points = sampling.sample_surface(shell, SAMPLES, seed=0)[0]
    sides = _sides(geometry.size_m)
    return solid_parts_of_surface(np.asarray(points, dtype=np.float64), sides)


SAMPLES = 200_000
"""Points on a mesh: 40 on each of the 6 × 28² cells that the faces of its box have at most, so that
folds with ten times that area get 4 a cell, and the gap that one in 50 is closes with its sides."""


def _sides(size_m: Sequence[float]) -> tuple[float, float, float]:
    """Sides of which none is thinner than the physics can hold."""
    x, y, z = (max(side, MIN_SIDE_M) for side in size_m)
    return x, y, z


def _pose(row: Table) -> Pose:
    place = row.optional_point3("place")
    turn_deg = row.optional_point3("turn_deg") or (0.0, 0.0, 0.0)
    if place is None or max(map(abs, place)) > FARTHEST_M:
        raise row.error("place", place, f"[x, y, z] within {FARTHEST_M:g} m")
    return Pose(rotation_from_vector(np.radians(turn_deg)), np.array(place))


def _parts(shape: str, size_m: tuple[float, float, float]) -> tuple[BoxPart, ...]:
    """Boxes that stop what touches the shape; a round one is an eight-sided pillar."""
    x, y, z = size_m
    centre = (0.0, 0.0, 0.5 * z)
    if shape == "box":
        return (BoxPart(Pose.from_yaw(0.0, centre), (0.5 * x, 0.5 * y, 0.5 * z)),)
    side, high = 0.5 * x * math.cos(math.pi / 8), 0.5 * z
    low = side * math.tan(math.pi / 8)
    boxes = [(0.0, (side, low, high)), (0.5 * math.pi, (side, low, high))]
    boxes += [(0.25 * math.pi, (side, low, high)), (-0.25 * math.pi, (side, low, high))]
    return tuple(BoxPart(Pose.from_yaw(yaw, centre), half) for yaw, half in boxes)


def _drawn_shape(
    shape: str, size_m: tuple[float, float, float], colour: tuple[float, float, float]
) -> TexturedMesh:
    import trimesh

    creation: Any = trimesh.creation
    x, y, z = size_m
    if shape == "box":
        solid = creation.box((x, y, z))
    elif shape == "ball":
        solid = creation.uv_sphere(0.5 * x, count=(ROUND_SIDES // 2, ROUND_SIDES))
    else:
        solid = creation.cylinder(0.5 * x, z, sections=ROUND_SIDES)
    vertices = np.asarray(solid.vertices) + np.array([0.0, 0.0, 0.5 * z])
    texel = np.clip(np.round(255.0 * np.array(colour)), 0, 255).astype(np.uint8)
    middle = np.full((len(vertices), 2), 0.5, np.float32)
    return TexturedMesh(vertices, np.asarray(solid.faces), middle, texel[None, None])


def _drawn_mesh(geometry: Geometry) -> TexturedMesh:
    """The triangles, each in the mean colour of its corners: a texel a triangle."""
    faces = geometry.faces
    count = len(faces)
    side = math.ceil(math.sqrt(count))
    texels: NDArray[np.uint8] = np.zeros((side * side, 3), np.uint8)
    texels[:count] = geometry.colours[faces].astype(np.float64).mean(axis=1).round()
    column, row = np.arange(count) % side, np.arange(count) // side
    middle = np.stack([(column + 0.5) / side, 1.0 - (row + 0.5) / side], axis=1)
    return TexturedMesh(
        geometry.vertices[faces].reshape(-1, 3).astype(np.float64),
        np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        np.repeat(middle, 3, axis=0).astype(np.float32),
        texels.reshape(side, side, 3),
    )
