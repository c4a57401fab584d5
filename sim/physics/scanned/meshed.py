"""Surfaces that a headset meshes of a room, beside the room's scan, in the cells that they change.

A scan is more exact than a headset's mesh. So the scan stays wherever the headset sees the same,
and what the headset alone sees is added, exchanged and taken away by its surfaces' names.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import spatial  # pyright: ignore[reportMissingTypeStubs]

from scenes.mesh import CollisionMesh, PhysicalObject
from scenes.pose import Pose
from sim.physics.collision.grid import Array, area_vectors
from sim.physics.collision.surface import Cell, Change, Surface, exchanged, pieces_of
from sim.physics.scanned.surface import without_objects

KNOWN_M = 0.08
"""Distance from the scan within which a headset's triangle shows what the scan has: its mesh is off
by up to 4 cm, its corners are 5 to 10 cm apart and cut off edges."""

SAMPLE_M = 0.06
"""Spacing of the scan's samples that triangles are compared with, metres; below `KNOWN_M`."""

MAX_SAMPLES = 400_000
"""Samples of a scan, chosen: 1,400 m² of surface; a larger one is sampled more coarsely."""

STILL_M, STILL_SHARE = 0.01, 0.15
"""Shift of a cell's content along any axis, metres, and change of its area as a share, up to which
a cell is as it was: what a headset's mesh trembles by."""

MIN_PIECE_M2 = 0.002
"""Area below which the content of a cell is left out: a shred of a mesh's edge, 4.5 cm wide."""

MAX_TRIANGLES = 200_000
"""Triangles of one surface, chosen: ten times what a headset sends of one at its finest."""


WELDED_M = 1e-4
"""Distance within which corners are one, metres: far below what a headset measures."""


@dataclass(frozen=True, slots=True, eq=False)
class Meshed:
    """A headset's surfaces beside a scan. Begin with `meshed_beside`.

    Attributes:
        scan: pieces of the scan by cell.
        samples: points of the scan, a tree of SciPy's.
        own: by surface id, its pieces by cell that the scan has not.
    """

    scan: Mapping[Cell, Array]
    samples: Any
    own: Mapping[str, Mapping[Cell, Array]] = field(
        default_factory=lambda: MappingProxyType(dict[str, Mapping[Cell, Array]]())
    )

    def content(self, cell: Cell) -> Array:
        """Return (T, 3, 3) all pieces of a cell, the grid's frame."""
        parts = [self.scan[cell]] if cell in self.scan else []
        parts += [pieces[cell] for pieces in self.own.values() if cell in pieces]
        return np.concatenate(parts) if parts else np.zeros((0, 3, 3))

    @property
    def triangles(self) -> int:
        """Number of its own pieces."""
        return sum(len(piece) for cells in self.own.values() for piece in cells.values())

    @property
    def cells(self) -> frozenset[Cell]:
        """Cells in which the headset sees more than the scan."""
        return frozenset(cell for pieces in self.own.values() for cell in pieces)


def meshed_beside(surface: Surface) -> Meshed:
    """Return an empty headset's mesh beside the surface of a scan."""
    pieces = list(surface.pieces.values())
    triangles = np.concatenate(pieces) if pieces else np.zeros((0, 3, 3))
    return Meshed(dict(surface.pieces), spatial.KDTree(surface.grid.to_world(_sampled(triangles))))


def with_surface(
    known: Meshed,
    surface: Surface,
    *,
    surface_id: str,
    triangles: Array,
    movables: Sequence[tuple[PhysicalObject, Pose]] = (),
) -> tuple[Meshed, dict[Cell, Array]]:
    """Return the mesh after one surface of the headset has changed, and the cells that changed.

    Args:
        known: the mesh so far.
        surface: static surface, whose grid it is.
        surface_id: the headset's name of the surface.
        triangles: (T, 3, 3) world metres; none of one that is gone.
        movables: objects that are not of the room, and where they are now.

    Raises:
        ValueError: a corner is not finite, or there are too many triangles.
    """
    if len(triangles) > MAX_TRIANGLES or not np.isfinite(triangles).all():
        raise ValueError(
            f"surface {surface_id}: {len(triangles)} triangles, wanted at most {MAX_TRIANGLES}, "
            "all finite; the headset meshes too finely"
        )
    new = pieces_of(_unknown(known, triangles, movables=movables), surface.grid)
    new = {cell: content for cell, content in new.items() if _area_m2(content) >= MIN_PIECE_M2}
    old = known.own.get(surface_id, {})
    changed = [cell for cell in old.keys() | new.keys() if _differs(old.get(cell), new.get(cell))]
    # A cell that only trembles keeps the content that it has: nothing there moves.
    kept = {cell: old[cell] for cell in old.keys() & new.keys() if cell not in set(changed)}
    now = kept | {cell: new[cell] for cell in changed if cell in new}
    own = {name: cells for name, cells in known.own.items() if name != surface_id}
    if now:
        own[surface_id] = MappingProxyType(now)
    after = replace(known, own=MappingProxyType(own))
    return after, {cell: after.content(cell) for cell in changed}


def change_of(surface: Surface, cells: Mapping[Cell, Array]) -> Change:
    """Return the change of the static surface that changed cells are."""
    return exchanged(surface, cells)


def hidden_mesh(known: Meshed, surface: Surface) -> CollisionMesh:
    """Return what the headset alone sees as a mesh, world metres."""
    pieces = [piece for cells in known.own.values() for piece in cells.values()]
    return _mesh(np.concatenate(pieces) if pieces else np.zeros((0, 3, 3)), surface)


def hidden_cells(
    known: Meshed, surface: Surface, *, cells: Iterable[Cell]
) -> dict[Cell, CollisionMesh]:
    """Return what the headset alone sees in each of some cells, world metres."""
    found: dict[Cell, CollisionMesh] = {}
    for cell in cells:
        pieces = [content[cell] for content in known.own.values() if cell in content]
        found[cell] = _mesh(np.concatenate(pieces) if pieces else np.zeros((0, 3, 3)), surface)
    return found


def whole_mesh(known: Meshed, surface: Surface, *, scanned: CollisionMesh) -> CollisionMesh:
    """Return the scan's own mesh and what the headset has added to it."""
    more = hidden_mesh(known, surface)
    return CollisionMesh(
        np.concatenate([scanned.vertices, more.vertices]).astype(scanned.vertices.dtype),
        np.concatenate([scanned.faces, more.faces + len(scanned.vertices)]).astype(np.int32),
    )


def _mesh(pieces: Array, surface: Surface) -> CollisionMesh:
    corners = surface.grid.to_world(pieces).reshape(-1, 3)
    vertices, index = _welded(corners)
    faces = index.reshape(-1, 3)
    is_area = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])
    is_area &= faces[:, 2] != faces[:, 0]
    return CollisionMesh(vertices.astype(np.float32), faces[is_area].astype(np.int32))


def _welded(corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return different places to `WELDED_M`, and by corner which of them it is."""
    steps = np.round(corners / WELDED_M).astype(np.int64)
    if not len(steps):
        return corners, np.zeros(0, np.int64)
    steps -= steps.min(axis=0)
    spans = steps.max(axis=0) + 1
    if math.prod(spans.tolist()) <= np.iinfo(np.int64).max:
        # One number a corner is sorted six times as fast as three: up to rooms of 200 m.
        steps = np.ravel_multi_index(tuple(steps.T), tuple(spans))
    axis = 0 if steps.ndim > 1 else None
    _, first, index = np.unique(steps, axis=axis, return_index=True, return_inverse=True)
    return WELDED_M * np.round(corners[first] / WELDED_M), index.ravel()


def _unknown(
    known: Meshed, triangles: Array, *, movables: Sequence[tuple[PhysicalObject, Pose]]
) -> Array:
    """Return the triangles that neither the scan has nor an object is."""
    if not len(triangles):
        return triangles
    placed = [replace(item, world_from_object=pose) for item, pose in movables]
    left = without_objects(triangles, placed) if placed else triangles
    if not len(left) or not known.samples.n:
        return left
    # All of a triangle has to be beside the scan: a large one may reach away from it.
    probes = np.concatenate([left, left.mean(axis=1, keepdims=True)], axis=1)
    places = probes.reshape(-1, 3)
    away, _ = known.samples.query(places, distance_upper_bound=KNOWN_M)
    return left[np.isinf(away).reshape(-1, 4).any(axis=1)]


def _differs(old: Array | None, new: Array | None) -> bool:
    """Return whether the contents of a cell differ by more than a mesh trembles."""
    if old is None or new is None:
        return old is not new
    before, after = area_vectors(old), area_vectors(new)
    area_before = np.linalg.norm(before, axis=1)
    area_after = np.linalg.norm(after, axis=1)
    total = max(float(area_before.sum()), float(area_after.sum()))
    if abs(float(area_before.sum() - area_after.sum())) > STILL_SHARE * total:
        return True
    if float(np.linalg.norm(before.sum(axis=0) - after.sum(axis=0))) > STILL_SHARE * total:
        return True
    middle_before = np.average(old.mean(axis=1), axis=0, weights=area_before + 1e-12)
    middle_after = np.average(new.mean(axis=1), axis=0, weights=area_after + 1e-12)
    return float(np.abs(middle_before - middle_after).max()) > STILL_M


def _area_m2(pieces: Array) -> float:
    return float(np.linalg.norm(area_vectors(pieces), axis=1).sum())


def _sampled(pieces: Array) -> Array:
    """Return points on pieces (T, 3, 3), about `SAMPLE_M` apart, and all corners."""
    if not len(pieces):
        return np.zeros((0, 3))
    areas = np.linalg.norm(area_vectors(pieces), axis=1)
    counts: NDArray[np.int64] = np.ceil(areas / SAMPLE_M**2).astype(np.int64)
    total = int(counts.sum())
    if total > MAX_SAMPLES:
        counts = np.maximum(counts * MAX_SAMPLES // total, 1)
    number = np.repeat(np.arange(len(pieces)), counts)
    within = np.arange(len(number)) - np.repeat(np.cumsum(counts) - counts, counts)
    # Two-dimensional golden sequence: even over a triangle, and the same every time.
    u = (0.5 + 0.7548776662466927 * within) % 1.0
    v = (0.5 + 0.5698402909980532 * within) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    a, b, c = (pieces[number, k] for k in range(3))
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return np.concatenate([points, pieces.reshape(-1, 3)])
