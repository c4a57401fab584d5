"""Sizes of what a user has added: sides of bodies; scale, unit and upper axis of meshes.

Pure functions from document to document, as in `edits.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.frames import WORLD_FROM_GLTF
from studio.app.model.documents.added_mesh import METRES, AddedMesh, Axis, Geometry
from studio.app.model.documents.document import Document, with_item
from studio.app.twin.additions import primitive_resized
from studio.app.twin.edits import EditError
from studio.app.twin.mesh_file import MAX_M, MIN_M

FLAT_M = 1e-6
"""A side of a mesh below this has no length that could be changed: a picture, a plane."""


def size_of(document: Document, item_id: str) -> tuple[float, float, float] | None:
    """Sides (x, y, z) of a body or mesh that was added, metres; None of all else: it keeps its."""
    twin = document.twin
    if item_id in twin.primitives:
        return twin.primitives[item_id].size_m
    return twin.meshes[item_id].size_m if item_id in twin.meshes else None


def resized(document: Document, item_id: str, size_m: Sequence[float]) -> Document:
    """A body or mesh with other sides (x, y, z); it stays where it stands.

    Raises:
        EditError: nothing of that id can be of another size, or a side is out of bounds.
    """
    if item_id not in document.twin.meshes:
        return primitive_resized(document, item_id, size_m)
    mesh = document.twin.meshes[item_id]
    try:
        sides = [float(side) for side in size_m]
    except (TypeError, ValueError):
        sides = []
    if len(sides) != 3:
        raise EditError(f"{item_id}: size {size_m!r}, wanted three lengths in m")
    scale = [
        factor if own < FLAT_M else side / own
        for side, own, factor in zip(sides, mesh.geometry.size_m, mesh.scale, strict=True)
    ]
    return _with_scale(document, mesh, scale)


def scaled(document: Document, item_id: str, factor: float) -> Document:
    """A mesh so many times as large as its file has it, in all directions alike.

    Raises:
        EditError: no mesh of that id, or it would be larger or smaller than a room can hold.
    """
    return _with_scale(document, _mesh(document, item_id), [factor] * 3)


def scale_of(mesh: AddedMesh) -> float:
    """How many times as large as in its file a mesh is, in the mean of all directions."""
    return math.prod(mesh.scale) ** (1 / 3)


def read_in_unit(document: Document, item_id: str, unit: str) -> Document:
    """A mesh whose file's lengths are in another unit.

    Raises:
        EditError: no mesh of that id, no such unit, or the mesh would fit no room in it.
    """
    mesh = _mesh(document, item_id)
    if unit not in METRES:
        raise EditError(f"{item_id}: unit {unit!r}, wanted one of {', '.join(METRES)}")
    factor = METRES[unit] / METRES[mesh.unit]
    _check(mesh, [factor * side for side in mesh.size_m], f"in {unit}")
    vertices = mesh.geometry.vertices * np.float32(factor)
    return _with(document, replace(mesh, geometry=_changed(mesh.geometry, vertices), unit=unit))


def read_with_up(document: Document, item_id: str, up: Axis) -> Document:
    """A mesh of whose file another axis is up; it stands on the same place.

    Raises:
        EditError: no mesh of that id, or no such axis.
    """
    mesh = _mesh(document, item_id)
    if up not in ("y", "z"):
        raise EditError(f"{item_id}: up {up!r}, wanted y or z")
    if up == mesh.up:
        return document
    turn = WORLD_FROM_GLTF if up == "y" else WORLD_FROM_GLTF.inverse()
    vertices = turn @ mesh.geometry.vertices.astype(np.float64)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    base = np.array([*(0.5 * (low + high))[:2], low[2]])
    x, y, z = np.abs(turn.rotation @ np.array(mesh.scale)).tolist()
    geometry = _changed(mesh.geometry, (vertices - base).astype(np.float32))
    return _with(document, replace(mesh, geometry=geometry, up=up, scale=(x, y, z)))


def _mesh(document: Document, item_id: str) -> AddedMesh:
    meshes = document.twin.meshes
    if item_id not in meshes:
        raise EditError(f"{item_id!r}: no such mesh; there are: {sorted(meshes) or 'none'}")
    return meshes[item_id]


def _with_scale(document: Document, mesh: AddedMesh, scale: Sequence[float]) -> Document:
    x, y, z = (float(factor) for factor in scale)
    sides = [factor * own for factor, own in zip((x, y, z), mesh.geometry.size_m, strict=True)]
    if not all(math.isfinite(factor) and factor > 0 for factor in (x, y, z)):
        raise EditError(f"{mesh.mesh_id}: sides of {sides} m, wanted lengths above 0")
    _check(mesh, sides, "then")
    return _with(document, replace(mesh, scale=(x, y, z)))


def _check(mesh: AddedMesh, sides: Sequence[float], when: str) -> None:
    longest = max(sides)
    if not MIN_M <= longest <= MAX_M:
        raise EditError(
            f"{mesh.source}: its longest side would be {longest:.3g} m {when}, limits {MIN_M:g} "
            f"to {MAX_M:g} m; it stays as it is"
        )


def _changed(geometry: Geometry, vertices: NDArray[np.float32]) -> Geometry:
    return Geometry(vertices, geometry.faces, geometry.colours)


def _with(document: Document, mesh: AddedMesh) -> Document:
    twin = document.twin
    meshes = with_item(twin.meshes, mesh.mesh_id, mesh)
    return replace(document, twin=replace(twin, meshes=meshes))
