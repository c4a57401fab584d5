"""Labels each splat of a trained room with its physical object, by the filmed meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import pixel_centres
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.reconstruction import View
from scenes.rays import RayScene
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SH_C0, SplatCloud

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
    return labels_by_mesh(cloud, parts_of(room))


def labels_by_mesh(cloud: SplatCloud, parts: Sequence[NDArray[np.float64]]) -> NDArray[np.intp]:
    """(N,) index of the nearest of some bodies, less one; -2 for floaters.

    Args:
        cloud: the splats.
        parts: (T, 3, 3) triangles of what never moves, then of each object.
    """
    distances = _distances(cloud, parts)
    nearest = distances.argmin(axis=0)
    return np.where(distances.min(axis=0) > FAR_M, -2, nearest - 1)


def between_two(cloud: SplatCloud, parts: Sequence[NDArray[np.float64]]) -> NDArray[np.bool_]:
    """(N,) the splats that are as near to one object as to another: their owner is open.

    A book's underside is the table's surface: what paints the book's lower edge lies in both.
    """
    nearest, second = np.sort(_distances(cloud, parts), axis=0)[:2]
    return np.asarray((second - nearest < TOUCHING_M) & (nearest <= FAR_M))


def parts_of(room: PhysicalRoom) -> list[NDArray[np.float64]]:
    """(T, 3, 3) triangles of what never moves, then of each object where it stands."""
    return [static_triangles(room), *(object_triangles(item) for item in room.objects)]


def _distances(cloud: SplatCloud, parts: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """(P, N) distance of each splat from each body, metres."""
    return np.stack([RayScene(triangles).distance(cloud.means) for triangles in parts])


def labels_by_light(
    cloud: SplatCloud,
    parts: Sequence[NDArray[np.float64]],
    *,
    viewpoints: Sequence[ViewPoint | View],
    renderer: NativeRenderer,
) -> NDArray[np.intp]:
    """(N,) index of a body, less one: that whose pixels most of a splat's light paints.

    A trained splat is placed where it makes the photos come out, not on the surface it paints: many
    lie centimetres before or behind. So over all views, the blend weights of a splat are summed on
    the true outline of each object (ray-cast against the meshes, occlusion included), and the one
    that holds most of its light owns it; else what never moves. Every splat counts equally, haze
    too; one that no view shows belongs to the nearest surface, as `labels_by_mesh` has it.

    Args:
        cloud: the splats.
        parts: (T, 3, 3) triangles of what never moves, then of each object.
        viewpoints: where the cloud was seen from.
        renderer: draws it.
    """
    owner = np.repeat(np.arange(len(parts)) - 1, [len(part) for part in parts])
    scene = RayScene(np.concatenate(parts))
    inside, seen = np.zeros((len(parts) - 1, len(cloud))), np.zeros(len(cloud))
    for view in viewpoints:
        camera = view.camera
        rays = camera.unproject(pixel_centres(camera)) @ view.world_from_camera.rotation.T
        hits = scene.cast(np.broadcast_to(view.world_from_camera.translation, rays.shape), rays)
        item = np.where(hits.triangle >= 0, owner[np.maximum(hits.triangle, 0)], -1)
        item = item.reshape(camera.height_px, camera.width_px)
        shown = [number for number in np.unique(item) if number >= 0]
        masks = [np.ones(item.shape, dtype=bool), *(item == number for number in shown)]
        everything, *own = lift_all(cloud, view, masks=masks, renderer=renderer)
        seen += everything
        for number, light in zip(shown, own, strict=True):
            inside[number] += light
    owned = inside > 0.5 * np.maximum(seen, 1e-9)
    by_light = np.where(owned.any(axis=0), owned.argmax(axis=0), -1)
    return np.where(seen > SEEN_PX, by_light, np.maximum(labels_by_mesh(cloud, parts), -1))


def lift_all(
    cloud: SplatCloud,
    view: ViewPoint | View,
    *,
    masks: Sequence[NDArray[np.bool_]],
    renderer: NativeRenderer,
) -> list[NDArray[np.float32]]:
    """(N,) blend weight of every splat inside each mask of one view, in pixels.

    As `scenes.prepare.cutout.votes.lifting.lift`, but one drawing serves all masks.
    """
    grey = SplatCloud(
        cloud.means,
        cloud.scales,
        cloud.rotations,
        cloud.opacities,
        np.zeros((len(cloud), 1, 3), dtype=np.float32),
    )
    posed = [PosedSplats(grey, Pose.identity())]
    recording = record(renderer, posed, view.camera, view.world_from_camera)
    found: list[NDArray[np.float32]] = []
    for first in range(0, len(masks), 3):
        group = masks[first : first + 3]
        d_rgb = np.zeros((*masks[0].shape, 3), dtype=np.float32)
        for channel, mask in enumerate(group):
            d_rgb[..., channel] = mask
        by_colour = recording.gradients(d_rgb=d_rgb).objects[0].sh[:, 0, :] / SH_C0
        found += [by_colour[:, channel].copy() for channel in range(len(group))]
    return found
