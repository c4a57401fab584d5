"""Collision mesh of a scan, or a room's boxes, as a mesh to draw."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scenes.mesh import BoxPart, CollisionMesh
from scenes.package import ScenePackage

FACES = ((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
         (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3))  # fmt: skip
"""Triangles of a box whose corner i has x, y and z by the bits 4, 2 and 1 of i."""


def collision_mesh(scene: ScenePackage) -> CollisionMesh:
    """The mesh that stops objects in a scene, world metres.

    Raises:
        ValueError: nothing in the scene stops anything.
    """
    from scenes.samples import SAMPLE_NAMES, sample_room

    if scene.collision is not None:
        return scene.collision
    solids = sample_room(str(scene.physical)).solids if scene.physical in SAMPLE_NAMES else ()
    if not solids:
        raise ValueError(
            f"{scene.name}: the scene has no collision mesh; prepare it from its photos to get one"
        )
    return boxes_mesh(solids)


def boxes_mesh(solids: Sequence[BoxPart]) -> CollisionMesh:
    """Boxes as triangles."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    vertices = [solid.object_from_box @ (corners * solid.half_size_m) for solid in solids]
    faces = [np.array(FACES) + 8 * number for number in range(len(solids))]
    return CollisionMesh(
        np.concatenate(vertices).astype(np.float32), np.concatenate(faces).astype(np.int32)
    )
