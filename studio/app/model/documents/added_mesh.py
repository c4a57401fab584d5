"""Meshes that a user has put into the twin."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.coloured_mesh import MOST_TRIANGLES, Geometry, unpacked
from scenes.pose import Pose

__all__ = ["MOST_TRIANGLES", "AddedMesh", "Geometry", "unpacked"]


@dataclass(frozen=True, slots=True, eq=False)
class AddedMesh:
    """A mesh of a file that a user has put into the twin.

    Attributes:
        mesh_id: unique in the document.
        source: name of the file it came from.
        geometry: its triangles; the same value wherever it stands.
        world_from_mesh: its frame stands on the mesh's base, Z up.
    """

    mesh_id: str
    source: str
    geometry: Geometry
    world_from_mesh: Pose
