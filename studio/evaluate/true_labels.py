"""Which physical thing each splat of a trained room belongs to, by the meshes that were filmed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.rays import RayScene
from scenes.splats import SplatCloud

FAR_M = 0.03
"""Splats farther from every surface than this float: they belong to nothing."""


def triangles_of(room: PhysicalRoom) -> NDArray[np.float64]:
    """(T, 3, 3) everything in the room, objects where they stand."""
    return np.concatenate([static_triangles(room), *(object_triangles(o) for o in room.objects)])


def static_triangles(room: PhysicalRoom) -> NDArray[np.float64]:
    """(T, 3, 3) what never moves."""
    return np.concatenate([mesh.vertices[mesh.faces] for mesh in room.static])


def object_triangles(item: PhysicalObject) -> NDArray[np.float64]:
    """(T, 3, 3) an object where it stands."""
    parts = [mesh.vertices[mesh.faces] for mesh in item.meshes]
    return item.world_from_object @ np.concatenate(parts)


def true_labels(cloud: SplatCloud, room: PhysicalRoom) -> NDArray[np.intp]:
    """(N,) index into `room.objects`, -1 for what never moves, -2 for floaters."""
    things = [static_triangles(room), *(object_triangles(item) for item in room.objects)]
    distances = np.stack([RayScene(triangles).distance(cloud.means) for triangles in things])
    nearest = distances.argmin(axis=0)
    return np.where(distances.min(axis=0) > FAR_M, -2, nearest - 1)
