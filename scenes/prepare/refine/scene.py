"""Refining an object or a region of a scene package, and undoing it to the byte.

An object is refined in the room that its photos show: with everything back where it was cut from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cut import Cut, divide, restore
from scenes.harmonics import turned
from scenes.package import ScenePackage
from scenes.package.records import Stage
from scenes.pose import Pose
from scenes.prepare.cutout.coverage.in_photos import with_coverage
from scenes.prepare.cutout.cutout import REFINED, REGION, undo_cut
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import View
from scenes.prepare.refine.refine import Refined, RefineOptions, refine
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud, concatenate

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class RefinedScene:
    """A package with a part refined, and how it went."""

    package: ScenePackage
    refined: Refined


def refine_object(
    package: ScenePackage,
    object_id: str,
    *,
    views: Sequence[View],
    options: RefineOptions,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> RefinedScene:
    """The package with an object's splats trained further; nothing else of it changes.

    Args:
        package: the scene; it is left as it is.
        object_id: of an object that was cut out of the room.
        views: the room's photos.
        options: how long and how large.
        rng: draws photos and splats.
        progress: called with the share done.

    Raises:
        KeyError: there is no such object.
        ValueError: it was not cut out of this room, or too few photos show it.
        Cancelled: as raised by `progress`.
    """
    item = package.object_by_id(object_id)
    room, is_object, object_from_world = _as_scanned(package, object_id)
    done = refine(room, is_object, views=views, options=options, rng=rng, progress=progress)
    nothing = np.zeros(0, dtype=np.uint32)
    record = Cut(
        object_id,
        nothing,
        package.room.select(nothing),
        nothing.astype(np.bool_),
        0,
        replaced=item.splats,
        replaced_coverage=item.coverage,
    )
    better = replace(item, splats=turned(done.splats, object_from_world), coverage=None)
    changed = replace(
        package,
        objects=tuple(better if other is item else other for other in package.objects),
        cuts=(*package.cuts, record),
        stages=(*package.stages, Stage(f"{REFINED} {object_id}", done.summary())),
    )
    if item.coverage is not None:
        changed = with_coverage(changed, object_id, renderer=NativeRenderer())
    return RefinedScene(changed, done)


def refine_region(
    package: ScenePackage,
    is_region: BoolArray,
    *,
    views: Sequence[View],
    options: RefineOptions,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> RefinedScene:
    """The package with a part of its room trained further; the other splats keep their bytes.

    Args:
        package: the scene; it is left as it is.
        is_region: (N,) bool, of the room's splats.
        views: the room's photos; objects that were cut out stand in them and are drawn there.
        options: how long and how large.
        rng: draws photos and splats.
        progress: called with the share done.

    Raises:
        ValueError: no splat is in the region, or too few photos show it.
        Cancelled: as raised by `progress`.
    """
    objects = [_where_scanned(package, item.object_id) for item in package.objects]
    room = concatenate([package.room, *(splats for splats in objects if splats is not None)])
    mask = np.zeros(len(room), dtype=np.bool_)
    mask[: len(is_region)] = is_region
    done = refine(room, mask, views=views, options=options, rng=rng, progress=progress)
    left, cut = divide(
        package.room,
        np.zeros_like(is_region),
        object_id="",
        floaters=is_region,
        fill=done.splats,
    )
    changed = replace(
        package,
        room=left,
        cuts=(*package.cuts, cut),
        stages=(*package.stages, Stage(f"{REFINED} {REGION}", done.summary())),
    )
    return RefinedScene(changed, done)


def in_sphere(room: SplatCloud, *, centre: Sequence[float], radius_m: float) -> BoolArray:
    """(N,) bool, the splats whose means lie in a sphere.

    Raises:
        ValueError: there are none.
    """
    apart = room.means.astype(np.float64) - np.asarray(centre, dtype=np.float64)
    inside = np.asarray((apart**2).sum(axis=1) <= radius_m**2, dtype=np.bool_)
    if not inside.any():
        x, y, z = centre
        raise ValueError(
            f"refine: no splat within {radius_m:g} m of ({x:g}, {y:g}, {z:g}) m; choose a place "
            "on a surface"
        )
    return inside


def _before_cut(package: ScenePackage, object_id: str) -> tuple[ScenePackage, Cut]:
    """The package as it was when an object had just been cut out, and that cut.

    Raises:
        ValueError: the object was not cut out of this room.
    """
    scene = package
    while scene.cuts:
        last = scene.cuts[-1]
        if last.object_id == object_id and last.replaced is None:
            if last.is_object.any():
                return scene, last
            break
        scene = undo_cut(scene)
    raise ValueError(
        f"scene {package.name!r}: {object_id!r} was not cut out of this room, so that none of its "
        "photos shows it; refine it in the scene it comes from"
    )


def _as_scanned(package: ScenePackage, object_id: str) -> tuple[SplatCloud, BoolArray, Pose]:
    """The room with the object in its place, which splats it is, and `object_from_world` there."""
    scene, cut = _before_cut(package, object_id)
    item = scene.object_by_id(object_id)
    room = restore(scene.room, cut)
    is_object = np.zeros(len(room), dtype=np.bool_)
    is_object[cut.places[cut.is_object]] = True
    others = [
        _where_scanned(scene, other.object_id) for other in scene.objects if other is not item
    ]
    parts = [room, *(splats for splats in others if splats is not None)]
    mask = np.zeros(sum(len(part) for part in parts), dtype=np.bool_)
    mask[: len(room)] = is_object
    object_from_world = _rigid(room.means[is_object], item.splats.means)
    return concatenate(parts), mask, object_from_world


def _where_scanned(package: ScenePackage, object_id: str) -> SplatCloud | None:
    """An object's splats in the room as it was scanned; None of one that came from elsewhere."""
    try:
        _, cut = _before_cut(package, object_id)
    except ValueError:
        return None
    return cut.taken.select(cut.is_object)


def _rigid(source: NDArray[np.float32], target: NDArray[np.float32]) -> Pose:
    """`target_from_source` of the same points in two frames (Kabsch 1976)."""
    a, b = source.astype(np.float64), target.astype(np.float64)
    middle_a, middle_b = a.mean(axis=0), b.mean(axis=0)
    u, _, vt = np.linalg.svd((b - middle_b).T @ (a - middle_a))
    u[:, -1] *= np.sign(np.linalg.det(u @ vt))
    rotation = u @ vt
    return Pose(rotation, middle_b - rotation @ middle_a)
