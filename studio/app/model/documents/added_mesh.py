"""Meshes that a user has put into the twin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenes.coloured_mesh import MAX_TRIANGLES, Geometry, unpacked
from scenes.pose import Pose

__all__ = ["MAX_TRIANGLES", "METRES", "AddedMesh", "Axis", "Geometry", "unpacked"]

METRES: dict[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""One of each unit that a file's lengths can be in, metres."""

Axis = Literal["y", "z"]
"""Upper axis of a file."""


@dataclass(frozen=True, slots=True, eq=False)
class AddedMesh:
    """A mesh of a file that a user has put into the twin.

    Attributes:
        mesh_id: unique in the document.
        source: name of the file it came from.
        geometry: its triangles as large as the file has them; the same value wherever it stands
            and however it is scaled.
        world_from_mesh: its frame stands on the mesh's base, Z up.
        unit: that the file's lengths were taken to be in, a key of `METRES`.
        up: which of the file's axes was taken to be up.
        scale: factors along its own x, y and z.
    """

    mesh_id: str
    source: str
    geometry: Geometry
    world_from_mesh: Pose
    unit: str = "m"
    up: Axis = "z"
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Extents (x, y, z) as it stands there, metres."""
        (x, y, z), (a, b, c) = self.geometry.size_m, self.scale
        return a * x, b * y, c * z

    @property
    def scaled(self) -> Geometry:
        """Its triangles as they stand there: of a large mesh this takes some tenths of a second."""
        if self.scale == (1.0, 1.0, 1.0):
            return self.geometry
        file = self.geometry
        return Geometry(
            file.vertices * np.array(self.scale, dtype=np.float32), file.faces, file.colours
        )
