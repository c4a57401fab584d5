"""Textured triangle meshes and the physical room made of them.

The meshes are the *physical world* of a simulated room; the splats are the *scan of it*.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.quad import QrCode

if TYPE_CHECKING:
    from scenes.splats import SplatCloud


@dataclass(frozen=True, slots=True, eq=False)
class TexturedMesh:
    """Triangles with one texture.

    Attributes:
        vertices: (V, 3) float64, metres.
        faces: (F, 3) int32 vertex indices, counter-clockwise seen from outside.
        uv: (V, 2) float32 in 0..1; (0, 0) is the bottom-left corner of the texture, as in OpenGL.
        texture: (H, W, 3) uint8 sRGB; row 0 is the top of the picture.

    Raises:
        ValueError: a shape is wrong, an index is out of range or a vertex is not finite.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    uv: NDArray[np.float32]
    texture: NDArray[np.uint8]

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        faces = np.ascontiguousarray(self.faces, dtype=np.int32)
        uv = np.ascontiguousarray(self.uv, dtype=np.float32)
        texture = np.ascontiguousarray(self.texture, dtype=np.uint8)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise ValueError(f"TexturedMesh.vertices: shape {vertices.shape}, wanted finite (V, 3)")
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise ValueError(f"TexturedMesh.faces: shape {faces.shape}, wanted (F, 3)")
        if len(faces) and not (faces.min() >= 0 and faces.max() < len(vertices)):
            raise ValueError(
                f"TexturedMesh.faces: index {faces.max()}, limit {len(vertices) - 1} (vertices - 1)"
            )
        if uv.shape != (len(vertices), 2):
            raise ValueError(f"TexturedMesh.uv: shape {uv.shape}, wanted ({len(vertices)}, 2)")
        if texture.ndim != 3 or texture.shape[2] != 3 or texture.size == 0:
            raise ValueError(f"TexturedMesh.texture: shape {texture.shape}, wanted (H, W, 3)")
        for name, array in (
            ("vertices", vertices),
            ("faces", faces),
            ("uv", uv),
            ("texture", texture),
        ):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def bounds(self) -> NDArray[np.float64]:
        """(2, 3): lowest and highest corner, metres."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])


@dataclass(frozen=True, slots=True, eq=False)
class CollisionMesh:
    """Triangles to collide with; nobody sees them.

    Attributes:
        vertices: (V, 3) float32, world metres.
        faces: (F, 3) int32, counter-clockwise seen from the free side.

    Raises:
        ValueError: a shape is wrong, an index out of range or a vertex not finite.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float32)
        faces = np.array(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise ValueError(
                f"CollisionMesh.vertices: shape {vertices.shape}, wanted finite (V, 3)"
            )
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise ValueError(f"CollisionMesh.faces: shape {faces.shape}, wanted (F, 3)")
        if len(faces) and not (faces.min() >= 0 and faces.max() < len(vertices)):
            raise ValueError(
                f"CollisionMesh.faces: index {faces.min()}..{faces.max()}, "
                f"limits 0..{len(vertices) - 1} (vertices - 1)"
            )
        for name, array in (("vertices", vertices), ("faces", faces)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)


@dataclass(frozen=True, slots=True)
class BoxPart:
    """A solid box of an object, used for contact.

    Attributes:
        object_from_box: pose of the box's centre in the object.
        half_size_m: half extents (x, y, z) in metres, > 0.
    """

    object_from_box: Pose
    half_size_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalObject:
    """A real, movable object of a simulated room.

    Attributes:
        object_id: unique, lower case, such as "chair-1".
        kind: what identical twins share, such as "chair".
        meshes: surfaces in the object's frame; origin on the support plane under the centre, Z up.
            Textures are albedo: whoever draws the object lights it.
        box_m: extents (x, y, z) of the up-fixed bounding box in metres.
        parts: solid boxes for contact.
        mass_kg: total mass.
        friction: sliding friction against the floor.
        world_from_object: where it stands when the room is scanned.
        splats: its surface where it was scanned, in the object's frame, from photos that the scan
            did not train on; `meshes` are then only what a picture without splats shows.
    """

    object_id: str
    kind: str
    meshes: tuple[TexturedMesh, ...]
    box_m: tuple[float, float, float]
    parts: tuple[BoxPart, ...]
    mass_kg: float
    friction: float
    world_from_object: Pose
    splats: SplatCloud | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalRoom:
    """The physical world of a room: what exists, before any scan of it.

    A built-in room is made of meshes and boxes. Of a room that was scanned, a second reconstruction
    from other photos stands for what exists (`splats`), and its mesh for what stops things.

    Textures of `static` meshes already contain the room's light without the objects (window, lamps,
    ambient occlusion). Objects carry albedo and are lit as `albedo · (ambient + key · max(0, n·l))`
    with `l` = `light_direction`, times whatever occlusion and shadow the drawer can afford.

    Attributes:
        name: such as "lab".
        static: everything that never moves.
        objects: everything that may move.
        solids: boxes in world coordinates that stop objects (floor excluded: it is z = 0).
        light_direction: (3,) unit vector from the room towards the main light (the window).
        ambient: share of light from everywhere.
        key: share of light from `light_direction`.
        world_from_rig: where the 360° camera stands by default.
        codes: printed QR codes on the walls.
        footprint_m: (2, 2) lowest and highest floor corner (x, y).
        splats: everything that never moves, of a scanned room; `static` is then empty.
        collision: what stops objects and people in a scanned room; `solids` is then empty.
    """

    name: str
    static: tuple[TexturedMesh, ...]
    objects: tuple[PhysicalObject, ...]
    solids: tuple[BoxPart, ...]
    light_direction: NDArray[np.float64]
    world_from_rig: Pose
    ambient: float = 0.55
    key: float = 0.5
    codes: tuple[QrCode, ...] = ()
    footprint_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, 2)))
    splats: SplatCloud | None = None
    collision: CollisionMesh | None = None

    def object_by_id(self, object_id: str) -> PhysicalObject:
        """The object with this id.

        Raises:
            KeyError: no such object; the message lists those there are.
        """
        for candidate in self.objects:
            if candidate.object_id == object_id:
                return candidate
        known = ", ".join(sorted(o.object_id for o in self.objects))
        raise KeyError(f"room {self.name!r} has no object {object_id!r}; it has: {known}")
