"""The record of what all photos of a room saw of one object, with what hid it from them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from scenes.coverage.directions import bits_of, packed
from scenes.coverage.record import Coverage
from scenes.coverage.sides import box_cells
from scenes.package import ScenePackage
from scenes.prepare.cutout.coverage.visibility import (
    crop_around,
    grey_scene,
    in_view,
    shown_cells,
    shown_splats,
    zoom_of,
)
from scenes.render.native import NativeRenderer
from scenes.state import ObjectModel

MIN_TRANSMITTANCE = 0.1
"""Share of a splat's light from which on a view shows it."""

MIN_FACING = 0.26
"""Cosine between a cell's normal and the way to a photo, at least: 75 degrees beside it a surface
is foreshortened to a quarter, and most of what is seen is its rim."""


def coverage_of(
    package: ScenePackage, item: ObjectModel, *, renderer: NativeRenderer
) -> Coverage | None:
    """Return what a package's views saw of one of its objects; None of a package without views.

    The other objects and the room hide it as they stand in the package: as they were photographed,
    but for what lies below it.

    Args:
        package: the scene.
        item: one of its objects, at the pose at which it was photographed.
        renderer: draws splats.
    """
    if not package.views:
        return None
    others = [other for other in package.objects if other.object_id != item.object_id]
    hiding = grey_scene(package.room, others)
    cells = box_cells(item.box_m)
    corners = item.world_from_object @ np.concatenate([cells.points[0], cells.points[1]])
    directions = np.zeros(len(item.splats), dtype=np.uint64)
    weights = np.zeros(len(item.splats))
    seen_cells = np.zeros(cells.points.shape[:2], dtype=np.bool_)
    own = item.splats.means.astype(np.float64)
    for view in package.views:
        pose = view.world_from_camera
        crop = crop_around(corners, view.camera, world_from_camera=pose)
        if crop is None:
            continue
        shown = shown_splats(
            item,
            in_view(hiding, crop, world_from_camera=pose),
            camera=crop,
            world_from_camera=pose,
            renderer=renderer,
        )
        is_shown = shown.transmittance >= MIN_TRANSMITTANCE
        towards = item.world_from_object.inverse() @ pose.translation - own
        directions |= np.where(is_shown, bits_of(towards), np.uint64(0))
        weights += shown.weights / zoom_of(crop, view.camera) ** 2
        seen_cells |= shown_cells(
            cells,
            item.world_from_object,
            drawn=shown.drawn,
            camera=crop,
            world_from_camera=pose,
            min_facing=MIN_FACING,
        )
    return Coverage(directions, weights.astype(np.float32), packed(seen_cells))


def with_coverage(
    package: ScenePackage, object_id: str, *, renderer: NativeRenderer
) -> ScenePackage:
    """The package with the record of one object, measured; as it is where it has no views.

    Raises:
        KeyError: there is no such object.
    """
    item = package.object_by_id(object_id)
    measured = replace(item, coverage=coverage_of(package, item, renderer=renderer))
    objects = tuple(
        measured if other.object_id == object_id else other for other in package.objects
    )
    return replace(package, objects=objects)


def missing_records(package: ScenePackage) -> Iterator[str]:
    """Ids of the objects whose record the package's views can give and nobody has measured."""
    if package.views:
        yield from (item.object_id for item in package.objects if item.coverage is None)
