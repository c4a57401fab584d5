"""Solids of a room that hands stay out of: fixed ones, and movable objects where they are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.bodies.solids import Solids, no_solids
from scenes.bodies.vectors import Array
from scenes.mesh import BoxPart, CollisionMesh
from scenes.pose import Pose

CELL_M, LEVEL_M = 0.08, 0.04
"""Size of a cell of a scanned surface, and thickness of a slab, metres: chosen, half a hand, and a
table's top."""

MIN_HEIGHT_M, MAX_HEIGHT_M = 0.12, 1.7
"""Surfaces that hands are kept out of, metres over the floor: lower is floor and rugs, higher is
what nobody reaches into."""

MIN_LEVEL = 0.9
"""Cosine between a surface's normal and up from which it is level: 26 degrees."""

MIN_SLAB_M2 = 0.03
"""Of a slab, chosen: half a page; smaller ones are a scan's roughness."""


@dataclass(frozen=True, slots=True, eq=False)
class Furniture:
    """Solids of a room.

    Attributes:
        fixed: world.
        parts: of each movable object, in its own frame.
        places: of objects until something else is known.
    """

    fixed: Solids
    parts: Mapping[str, Solids]
    places: Mapping[str, Pose]

    def at(self, poses: Mapping[str, Pose]) -> Solids:
        """Return all solids with objects where they are."""
        found = [self.fixed]
        for key, parts in self.parts.items():
            pose = poses.get(key, self.places.get(key))
            if pose is not None:
                found.append(parts.placed(pose))
        return joined(found)


def joined(parts: Iterable[Solids]) -> Solids:
    """Return solids of several kinds as one."""
    kept = [each for each in parts if len(each.centres)]
    if not kept:
        return no_solids()
    return Solids(
        np.concatenate([each.centres for each in kept]),
        np.concatenate([each.rotations for each in kept]),
        np.concatenate([each.halves for each in kept]),
    )


def solids_of(boxes: Iterable[BoxPart]) -> Solids:
    """Return boxes as solids of the same frame."""
    kept = list(boxes)
    if not kept:
        return no_solids()
    return Solids(
        np.array([box.object_from_box.translation for box in kept]),
        np.array([box.object_from_box.rotation for box in kept]),
        np.array([box.half_size_m for box in kept], dtype=np.float64),
    )


def level_slabs(mesh: CollisionMesh) -> Solids:
    """Return tops of tables, seats and shelves of a scanned room, as slabs of `LEVEL_M`."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    heights = corners[:, :, 2].mean(axis=1)
    is_level = normals[:, 2] > MIN_LEVEL * np.maximum(areas, 1e-12)
    kept = is_level & (heights > MIN_HEIGHT_M) & (heights < MAX_HEIGHT_M)
    points = _spread(corners[kept])
    if not len(points):
        return no_solids()
    cells = np.floor(points / (CELL_M, CELL_M, LEVEL_M)).astype(np.int64)
    return _merged(np.unique(cells, axis=0))


def _spread(corners: Array) -> Array:
    """Return points on triangles (F, 3, 3), close enough that no cell between is left out."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    found = list[Array]()
    counts = np.clip(np.ceil(sides / (0.5 * CELL_M)).astype(int), 1, 64)
    for count in np.unique(counts):
        own = corners[counts == count]
        a, b = np.indices((int(count) + 1, int(count) + 1)).reshape(2, -1) / float(count)
        shares: Array = np.stack([1.0 - a - b, a, b], axis=1)
        shares = shares[shares[:, 0] > -1e-9]
        found.append(np.einsum("pk,fkd->fpd", shares, own).reshape(-1, 3))
    return np.concatenate(found) if found else np.zeros((0, 3))


def _merged(cells: NDArray[np.int64]) -> Solids:
    """Return cells (N, 3) of each level joined to rectangles, the widest first along x."""
    centres, halves = list[Array](), list[Array]()
    for level in np.unique(cells[:, 2]):
        left = {(int(x), int(y)) for x, y, z in cells if z == level}
        while left:
            x, y = min(left)
            wide = 1
            while (x + wide, y) in left:
                wide += 1
            deep = 1
            while all((x + k, y + deep) in left for k in range(wide)):
                deep += 1
            left -= {(x + i, y + j) for i in range(wide) for j in range(deep)}
            size = np.array([wide * CELL_M, deep * CELL_M, LEVEL_M])
            if size[0] * size[1] < MIN_SLAB_M2:
                continue
            low = np.array([x * CELL_M, y * CELL_M, level * LEVEL_M])
            centres.append(low + 0.5 * size)
            halves.append(0.5 * size)
    if not centres:
        return no_solids()
    return Solids(np.array(centres), np.tile(np.eye(3), (len(centres), 1, 1)), np.array(halves))
