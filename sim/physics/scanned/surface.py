"""The surface of a scanned room without its movable objects: checked, repaired, clear of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import CollisionMesh, PhysicalObject
from scenes.pose import Pose
from sim.physics.collision.grid import Array, area_vectors, cut_at_grid
from sim.physics.collision.limits import Plane
from sim.physics.collision.orientation import piece_areas_m2, turn_to_free_side
from sim.physics.collision.overlap import depths_in_patches
from sim.physics.collision.patches import Patches, joined
from sim.physics.collision.surface import Surface, surface_of, triangles_of
from sim.physics.engine import mujoco
from sim.physics.moving.objects import add_object

LARGEST_M = 200.0
"""Longest side of a room: a mesh beyond it is in millimetres."""
LOWEST_M = -0.5
"""Height of a mesh's lowest corner down to which z = 0 is taken to be its floor."""
OBJECT_MARGIN_M = 0.02
"""Distance from a movable object within which a scan shows the object, not the room."""
SHELL_MARGIN_M = 0.06
"""The same distance where it looks away from the object: a mesh is fused in cells of 3 to 5 cm."""
SHRED_M2 = 0.1
"""Surface of a piece below which it is a shred: no wall, and what is left of an object."""
SUPPORT_M = 0.01
"""Height above an object's own support below which a level surface is what it stands on."""
RIM_M = 0.03
"""Height above its own support up to which a rough support is no shell of the object."""
LEVEL = 0.7
"""Cosine to up above which a surface can carry: 45 degrees."""
TOLERATED_M = 0.0005
"""Overlap with an object at the start that physics may resolve at once."""
MIN_DEPTH_M = 0.006
"""Thickness below which nothing is left of a patch that is made thinner."""
RIPPLE_M = 0.05
"""Height above the floor up to which a steep patch is a ripple of it, on which legs would catch."""
SUPPORT_DEPTH_M = 0.02
"""Thickness of the level surface under an object."""
ON_FLOOR_M = 0.01
"""Height above the floor up to which an object stands on the floor."""
ON_OBJECT_M = 0.04
"""Height above another object's box up to which an object stands on that."""


@dataclass(frozen=True, slots=True, eq=False)
class ScannedSurface:
    """Static surface around the objects that stand in it.

    Attributes:
        surface: none of its patches reaches into an object.
        movables: the objects, none below the floor.
        notes: what had to be assumed or changed, a sentence each.
    """

    surface: Surface
    movables: tuple[PhysicalObject, ...]
    notes: tuple[str, ...]


def scanned_surface(
    mesh: CollisionMesh, movables: Sequence[PhysicalObject], *, name: str
) -> ScannedSurface:
    """Make a scan's mesh ready for physics.

    Args:
        mesh: with holes, turned or degenerate triangles, as scans are.
        movables: where they stood when it was scanned.
        name: of the room, for messages.

    Raises:
        ValueError: there is no surface, it is no room's size, or it has no floor and does not
            begin near z = 0.
    """
    _check(mesh, name)
    triangles = turn_to_free_side(triangles_of(mesh))
    surface = surface_of(without_objects(triangles, movables))
    surface, notes = _with_floor(surface, mesh, name)
    surface = replace(surface, patches=_without_ripples(surface.patches, surface.planes))
    lifted = tuple(_above_floor(item, surface.planes) for item in movables)
    for before, now in zip(movables, lifted, strict=True):
        rise = now.world_from_object.translation[2] - before.world_from_object.translation[2]
        if rise > ON_FLOOR_M:
            notes.append(f"{now.object_id}: lifted by {100 * rise:.0f} cm, it was below the floor")
    return ScannedSurface(_clear_of(surface, lifted), lifted, tuple(notes))


def without_objects(triangles: Array, movables: Sequence[PhysicalObject]) -> Array:
    """The triangles (T, 3, 3) that are no movable object's, as some were scanned before the cut."""
    centre, vectors = triangles.mean(axis=1), area_vectors(triangles)
    is_level = vectors[:, 2] > LEVEL * np.linalg.norm(vectors, axis=1)
    stays = np.ones(len(triangles), dtype=np.bool_)
    is_in = [_is_in_box(item, centre) for item in movables]
    left = ~np.any(is_in, axis=0) if is_in else stays
    is_shred = np.zeros(len(triangles), dtype=np.bool_)
    is_shred[left] = piece_areas_m2(triangles[left]) < SHRED_M2
    for item in movables:
        pose = item.world_from_object
        local = pose.inverse() @ centre
        beyond = np.abs(local[:, :2]) - 0.5 * np.asarray(item.box_m[:2])
        above = np.abs(local[:, 2] - 0.5 * item.box_m[2]) - 0.5 * item.box_m[2]
        is_support = is_level & (local[:, 2] < SUPPORT_M)
        is_in = (beyond < OBJECT_MARGIN_M).all(axis=1) & (above < OBJECT_MARGIN_M)
        # A wall or a table beside the object looks at it; its own shell looks away.
        to_middle = local - (0.0, 0.0, 0.5 * item.box_m[2])
        away = np.einsum("nk,nk->n", vectors @ pose.rotation, to_middle) > 0.0
        is_shell = (beyond < SHELL_MARGIN_M).all(axis=1) & (above < SHELL_MARGIN_M)
        on_floor = abs(float(pose.translation[2])) < RIM_M
        # The floor is level below an object; what rises there, whichever way it looks, is its feet.
        is_foot = (local[:, 2] < RIM_M) & ~is_support & on_floor
        is_shell &= is_foot | ((away | is_shred) & (local[:, 2] > RIM_M))
        stays &= ~((is_in & ~is_support) | is_shell)
    return triangles[stays]


def _is_in_box(item: PhysicalObject, points: Array) -> NDArray[np.bool_]:
    """(N,) which points (N, 3) lie in an object's box, or just beside it."""
    local = item.world_from_object.inverse() @ points
    beyond = np.abs(local[:, :2]) - 0.5 * np.asarray(item.box_m[:2])
    above = np.abs(local[:, 2] - 0.5 * item.box_m[2]) - 0.5 * item.box_m[2]
    return np.asarray((beyond < OBJECT_MARGIN_M).all(axis=1) & (above < OBJECT_MARGIN_M))


def _check(mesh: CollisionMesh, name: str) -> None:
    if not len(mesh.faces):
        raise ValueError(f"room {name!r}: its collision mesh has no triangles; prepare it with one")
    used = mesh.vertices[mesh.faces.ravel()]
    span = float((used.max(axis=0) - used.min(axis=0)).max())
    if span > LARGEST_M:
        raise ValueError(
            f"room {name!r}: its collision mesh spans {span:.0f} m, limit {LARGEST_M:.0f} m; "
            "is it in millimetres? scale it to metres"
        )


def _with_floor(surface: Surface, mesh: CollisionMesh, name: str) -> tuple[Surface, list[str]]:
    """The surface with a floor: the scan's, or else z = 0 where that may be the floor."""
    ups = [plane for plane in surface.planes if plane.normal[2] > LEVEL]
    if any(plane.is_surface for plane in ups):
        return surface, []
    lowest = float(mesh.vertices[mesh.faces.ravel(), 2].min())
    if lowest < LOWEST_M:
        raise ValueError(
            f"room {name!r}: its collision mesh has no floor and its lowest corner is at "
            f"z = {lowest:.2f} m, limit {LOWEST_M:g} m; shift it so that the floor is z = 0"
        )
    floor = Plane((0.0, 0.0, 1.0), 0.0, is_surface=True)
    planes = (floor, *(plane for plane in surface.planes if plane not in ups))
    note = f"room {name!r}: its collision mesh has no floor; one was put at z = 0"
    return replace(surface, planes=planes), [note]


def _without_ripples(patches: Patches, planes: Sequence[Plane]) -> Patches:
    """The patches without those that rise from the floor by less than a scan's noise."""
    stays = np.ones(len(patches), dtype=np.bool_)
    for plane in planes:
        if plane.is_surface and plane.normal[2] > LEVEL:
            across = np.abs(np.asarray(plane.normal) @ patches.world_from_patch[:, :, :2])
            top = plane.height(patches.centre) + np.sum(across * patches.half_m, axis=1)
            stays &= top > RIPPLE_M
    return patches.chosen(stays)


def _above_floor(item: PhysicalObject, planes: Sequence[Plane]) -> PhysicalObject:
    pose = item.world_from_object
    floor = _floor_m(pose.translation, planes)
    if pose.translation[2] >= floor:
        return item
    place = np.array([*pose.translation[:2], floor])
    return replace(item, world_from_object=Pose(pose.rotation, place))


def _floor_m(place: Array, planes: Sequence[Plane]) -> float:
    """Height of the floor under a place."""
    ups = [plane for plane in planes if plane.normal[2] > LEVEL]
    return max((p.offset_m - float(np.dot(p.normal[:2], place[:2]))) / p.normal[2] for p in ups)


def _clear_of(surface: Surface, movables: Sequence[PhysicalObject]) -> Surface:
    """The surface with nothing in the objects, and something level under each."""
    if not movables:
        return surface
    patches = _thinned(surface.patches, movables)
    pieces = dict(surface.pieces)
    for item in movables:
        if not _stands_on_surface(item, movables, surface.planes):
            continue
        support = _support_of(item, surface)
        patches = joined(patches, support)
        corners = support.centre[0] + np.array(
            [
                support.world_from_patch[0]
                @ (x * support.half_m[0, 0], y * support.half_m[0, 1], 0)
                for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
        )
        local = surface.grid.from_world(corners[[[0, 1, 2], [0, 2, 3]]])
        for piece in cut_at_grid(local, surface.grid.cell_m):
            x, y, z = np.floor(piece.mean(axis=0) / surface.grid.cell_m).astype(int).tolist()
            known = pieces.get((x, y, z), np.zeros((0, 3, 3)))
            pieces[x, y, z] = np.concatenate([known, piece[None]])
    return replace(surface, patches=patches, pieces=pieces)


def _thinned(patches: Patches, movables: Sequence[PhysicalObject]) -> Patches:
    """The patches, each only as thick as it is outside the objects; gone where that is nothing."""
    model, data = _model_of(movables)
    geoms: NDArray[np.int64] = np.arange(int(model.ngeom), dtype=np.int64)
    gap = np.linalg.norm(patches.centre[:, None] - data.geom_xpos[None], axis=2)
    reach = np.linalg.norm(patches.half_m, axis=1) + patches.depth_m
    near = np.flatnonzero((gap < reach[:, None] + model.geom_rbound[None]).any(axis=1))
    if not len(near):
        return patches
    depths, backs = depths_in_patches(patches.chosen(near), model, data, geoms)
    is_in = np.minimum(depths, backs) > TOLERATED_M
    from_face = np.where(is_in, depths, 0.0).max(axis=1)
    from_back = np.where(is_in, backs, 0.0).max(axis=1)
    lowered = np.where(from_face <= from_back, from_face, 0.0)
    thinner = np.minimum(from_face, from_back)
    centre, depth_m = patches.centre.copy(), patches.depth_m.copy()
    centre[near] -= patches.normal[near] * lowered[:, None]
    depth_m[near] -= thinner
    stays = np.ones(len(patches), dtype=np.bool_)
    stays[near] = (thinner == 0.0) | (depth_m[near] >= MIN_DEPTH_M)
    cut = Patches(centre, patches.world_from_patch, patches.half_m, depth_m, patches.cell)
    return cut.chosen(stays)


def _model_of(movables: Sequence[PhysicalObject]) -> tuple[Any, Any]:
    """A model of the objects alone, where they stand."""
    spec = mujoco.MjSpec()
    for item in movables:
        add_object(spec, item, item.world_from_object)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def _stands_on_surface(
    item: PhysicalObject, movables: Sequence[PhysicalObject], planes: Sequence[Plane]
) -> bool:
    """Whether an object stands on the scanned surface, and not on the floor or another object."""
    place = item.world_from_object.translation
    if place[2] < _floor_m(place, planes) + ON_FLOOR_M:
        return False
    for other in movables:
        if other is item:
            continue
        local = other.world_from_object.inverse() @ place
        beside = np.abs(local[:2]) < 0.5 * np.asarray(other.box_m[:2])
        if beside.all() and 0.0 < local[2] < other.box_m[2] + ON_OBJECT_M:
            return False
    return True


def _support_of(item: PhysicalObject, surface: Surface) -> Patches:
    """A level patch under an object: it stood there, so something carried it."""
    pose = item.world_from_object
    half = 0.5 * np.asarray(item.box_m[:2])
    inside = surface.grid.from_world(pose.translation - (0.0, 0.0, 1e-6))
    return Patches(
        pose.translation[None].copy(),
        Pose.from_yaw(pose.yaw()).rotation[None],
        half[None],
        np.array([SUPPORT_DEPTH_M]),
        np.floor(inside / surface.grid.cell_m).astype(np.int64)[None],
    )
