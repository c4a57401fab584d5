"""A movable object before it has a place: its surfaces, box, solid parts, and true symmetry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.random_rooms.finishes import Finish
from scenes.mesh import BoxPart, PhysicalObject, TexturedMesh
from scenes.pose import Pose
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.shapes import Surface, placed

ATLAS_PX = 1024
"""Width of an object's texture, pixels; as wide as that of the built-in rooms' objects."""

ROUND = 0
"""Symmetry of what looks the same at every yaw."""

FLOOR, TOP, SEAT = "floor", "top", "seat"
"""Supports of an object: the floor, a table or cabinet, a sofa."""


@dataclass(frozen=True, slots=True, eq=False)
class Movable:
    """A movable object of some family; twins share one.

    Attributes:
        family: such as "stool".
        finish: "plain", "patterned", "dark" or "shiny".
        surfaces: in the object's frame; origin on the support plane, Z up.
        box_m: extents (x, y, z) of the upright box about the origin, metres.
        parts: solid boxes for contact and shadows.
        mass_kg: total mass.
        friction: sliding friction.
        symmetry: how many yaws in a turn look the same; `ROUND` if all do.
        on: what it may stand on.
        gloss: strength of its highlights, 0..1 of full white; 0 for a dull surface.
    """

    family: str
    finish: str
    surfaces: tuple[Surface, ...]
    box_m: tuple[float, float, float]
    parts: tuple[BoxPart, ...]
    mass_kg: float
    friction: float
    symmetry: int
    on: tuple[str, ...]
    gloss: float

    def mesh(self) -> TexturedMesh:
        """Its surfaces as one mesh, without highlights."""
        return mesh_from_surfaces(self.surfaces, width_px=ATLAS_PX)

    def physical(
        self, object_id: str, kind: str, world_from_object: Pose, mesh: TexturedMesh
    ) -> PhysicalObject:
        """The object of this name, at a place.

        Args:
            object_id: unique in the room.
            kind: what its twins share.
            world_from_object: where it stands.
            mesh: its surfaces with or without highlights.
        """
        return PhysicalObject(
            object_id, kind, (mesh,), self.box_m, self.parts, self.mass_kg, self.friction,
            world_from_object,
        )  # fmt: skip


def movable(
    family: str,
    surfaces: Iterable[Surface],
    parts: Sequence[BoxPart],
    *,
    finish: Finish,
    mass_kg: float,
    symmetry: int,
    on: tuple[str, ...],
    friction: float = 0.45,
) -> Movable:
    """Puts the surfaces onto z = 0 and measures the box.

    What looks the same at several yaws keeps its axis as its origin; anything else is centred.

    Args:
        family: its name.
        surfaces: in any frame with Z up and, where there is a symmetry, its axis at x = y = 0.
        parts: solid boxes in the same frame.
        finish: of its largest part.
        mass_kg: total mass.
        symmetry: how many yaws in a turn look the same.
        on: what it may stand on.
        friction: sliding friction.
    """
    made = tuple(surfaces)
    points = np.concatenate([surface.points.reshape(-1, 3) for surface in made])
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high) if symmetry == 1 else np.zeros(3)
    extent = 2.0 * np.maximum(high - middle, middle - low)
    shift = Pose(np.eye(3), np.array([-middle[0], -middle[1], -low[2]]))
    return Movable(
        family,
        finish.name,
        tuple(placed(made, shift)),
        (float(extent[0]), float(extent[1]), float(high[2] - low[2])),
        tuple(BoxPart(shift @ part.object_from_box, part.half_size_m) for part in parts),
        mass_kg,
        friction,
        symmetry,
        on,
        finish.gloss,
    )


def part(centre: Sequence[float], half: tuple[float, float, float]) -> BoxPart:
    """A level solid box by its centre and half extents, metres."""
    return BoxPart(Pose.from_yaw(0.0, centre), half)
