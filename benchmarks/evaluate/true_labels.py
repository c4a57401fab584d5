"""Labels each splat of a trained room with its physical object, by the filmed meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import pixel_centres
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.lifting import lift
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

FAR_M = 0.03
"""Splats farther from every surface than this float: they belong to nothing."""
TOUCHING_M = 1e-4
"""Distances that differ by less are equal."""
SEEN_PX = 0.5
"""Blend weight, in pixels over all views, below which a splat is seen in none."""


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
    return labels_by_mesh(cloud, _parts(room))


def labels_by_mesh(cloud: SplatCloud, parts: Sequence[NDArray[np.float64]]) -> NDArray[np.intp]:
    """(N,) index of the nearest of some bodies, less one; -2 for floaters.

    Args:
        cloud: the splats.
        parts: (T, 3, 3) triangles of what never moves, then of each object.
    """
    distances = _distances(cloud, parts)
    nearest = distances.argmin(axis=0)
    return np.where(distances.min(axis=0) > FAR_M, -2, nearest - 1)


def between_two(cloud: SplatCloud, room: PhysicalRoom) -> NDArray[np.bool_]:
    """(N,) the splats that are as near to one object as to another: their owner is open.

    A book's underside is the table's surface: what paints the book's lower edge lies in both.
    """
    nearest, second = np.sort(_distances(cloud, _parts(room)), axis=0)[:2]
    return np.asarray((second - nearest < TOUCHING_M) & (nearest <= FAR_M))


def _parts(room: PhysicalRoom) -> list[NDArray[np.float64]]:
    """(T, 3, 3) triangles of what never moves, then of each object where it stands."""
    return [static_triangles(room), *(object_triangles(item) for item in room.objects)]


def _distances(cloud: SplatCloud, parts: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """(P, N) distance of each splat from each body, metres."""
    return np.stack([RayScene(triangles).distance(cloud.means) for triangles in parts])


def labels_by_light(
    cloud: SplatCloud,
    room: PhysicalRoom,
    viewpoints: Sequence[ViewPoint],
    *,
    renderer: NativeRenderer,
) -> NDArray[np.intp]:
    """(N,) index into `room.objects`, -1 for all else: whose pixels most of a splat's light paints.

    A trained splat is placed where it makes the photos come out, not on the surface it paints: many
    lie centimetres before or behind. So over all views, the blend weights of a splat are summed on
    the true outline of each object (ray-cast against the meshes, occlusion included), and the one
    that holds most of its light owns it. Every splat counts equally, haze too; one that no view
    shows belongs to the nearest surface, as `true_labels` has it.
    """
    parts = [static_triangles(room), *(object_triangles(item) for item in room.objects)]
    owner = np.repeat(np.arange(len(parts)) - 1, [len(part) for part in parts])
    scene = RayScene(np.concatenate(parts))
    inside, seen = np.zeros((len(room.objects), len(cloud))), np.zeros(len(cloud))
    for view in viewpoints:
        camera = view.camera
        rays = camera.unproject(pixel_centres(camera)) @ view.world_from_camera.rotation.T
        hits = scene.cast(np.broadcast_to(view.world_from_camera.translation, rays.shape), rays)
        item = np.where(hits.triangle >= 0, owner[np.maximum(hits.triangle, 0)], -1)
        item = item.reshape(camera.height_px, camera.width_px)
        all_light = None
        for number in range(len(room.objects)):
            mask = item == number
            if not mask.any() and all_light is not None:
                continue
            masked = MaskedView(view.name, camera, view.world_from_camera, mask)
            vote = lift(cloud, masked, renderer=renderer)
            inside[number] += vote.inside
            all_light = vote.seen
        if all_light is not None:
            seen += all_light
    owned = inside > 0.5 * np.maximum(seen, 1e-9)
    by_light = np.where(owned.any(axis=0), owned.argmax(axis=0), -1)
    return np.where(seen > SEEN_PX, by_light, np.maximum(true_labels(cloud, room), -1))
