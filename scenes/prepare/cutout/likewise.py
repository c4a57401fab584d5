"""Another reconstruction of the same room, taken apart as the scan was.

Nobody marks the objects a second time: the scan's own objects, drawn in its views, are the masks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.harmonics import turned
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.cutout import cut_out
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.progress import Progress, silent
from scenes.render.front import front_of
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud
from scenes.state import ObjectModel

VIEWS = 3
"""Masks of an object, as many as a careful person gives."""
MIN_TURN_RAD = 0.5
"""From sides so far apart, as a person would choose them."""
MIN_SHARE_IN_SIGHT = 0.8
"""Share of an object's outline that has to be in sight: a mask with a piece missing cuts it off."""
SOLID = 0.5
"""Share of a pixel's light from which on the pixel is the object's."""
EDGE_PX = 2.0
"""An outline this near to the picture's edge may go on beyond it."""


@dataclass(frozen=True, slots=True, eq=False)
class TakenApart:
    """A reconstruction in parts.

    Attributes:
        room: what does not move, holes filled and shadows taken out; world metres.
        objects: by id, in the frame of the scan's object.
        missing: why an object could not be separated, by id; it is a part of the room.
    """

    room: SplatCloud
    objects: dict[str, SplatCloud]
    missing: dict[str, str]


def taken_apart_like(
    scene: ScenePackage,
    cloud: SplatCloud,
    *,
    renderer: NativeRenderer,
    progress: Progress = silent,
) -> TakenApart:
    """Separate the movable objects of a scan in another reconstruction of its room.

    Args:
        scene: whose objects were cut out; those that came from elsewhere have no splats in `cloud`.
        cloud: the other reconstruction, in the scan's world, metres.
        renderer: draws both.
        progress: called before each object.
    """
    package = replace(scene, room=cloud, objects=(), cuts=(), stages=())
    objects: dict[str, SplatCloud] = {}
    missing: dict[str, str] = {}
    wanted = {cut.object_id for cut in scene.cuts if len(cut.taken)}
    items = [item for item in scene.objects if item.object_id in wanted]
    for number, item in enumerate(items):
        progress(number / len(items), item.object_id)
        try:
            done = cut_out(
                package,
                masks_of(scene, item, renderer),
                object_id=item.object_id,
                name=item.name,
                kind=item.kind,
                renderer=renderer,
            )
        except ValueError as refused:
            missing[item.object_id] = str(refused)
            continue
        package = done.package
        scan_from_cut = item.world_from_object.inverse() @ done.item.world_from_object
        objects[item.object_id] = turned(done.item.splats, scan_from_cut)
    return TakenApart(package.room, objects, missing)


def masks_of(
    scene: ScenePackage, item: ObjectModel, renderer: NativeRenderer
) -> tuple[MaskedView, ...]:
    """Masks of one of a scan's objects in up to three views, each from another side.

    Raises:
        ValueError: no view shows enough of it.
    """
    ranked = [
        (view, area_px, _bearing(view, item)) for view, area_px in _framing(scene.views, item)
    ]
    ranked.sort(key=lambda entry: -entry[1])
    chosen: list[tuple[MaskedView, float]] = []
    for view, _, bearing in ranked:
        apart = [abs(math.remainder(bearing - other, 2.0 * math.pi)) for _, other in chosen]
        if len(chosen) == VIEWS or any(turn < MIN_TURN_RAD for turn in apart):
            continue
        masked = _mask(scene, item, view, renderer)
        if masked is not None:
            chosen.append((masked, bearing))
    if not chosen:
        raise ValueError(
            f"{item.object_id}: none of the scan's {len(scene.views)} views shows "
            f"{MIN_SHARE_IN_SIGHT:.0%} of it"
        )
    return tuple(masked for masked, _ in chosen)


def _framing(views: Sequence[ViewPoint], item: ObjectModel) -> list[tuple[ViewPoint, float]]:
    """The pinhole views in whose picture an object's box lies whole, and its area there, px²."""
    found: list[tuple[ViewPoint, float]] = []
    for view in views:
        if not isinstance(view.camera, Pinhole):
            continue
        corners = view.world_from_camera.inverse() @ (item.world_from_object @ _corners(item))
        if (corners[:, 2] <= 0).any():
            continue
        pixels, _ = view.camera.project(corners)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        limit = np.array([view.camera.width_px, view.camera.height_px])
        if (low > EDGE_PX).all() and (high < limit - EDGE_PX).all():
            width, height = (high - low).tolist()
            found.append((view, width * height))
    return found


def _corners(item: ObjectModel) -> NDArray[np.float64]:
    """(8, 3) of the object's box, in its own frame."""
    unit = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
    return unit * np.array(item.box_m)


def _bearing(view: ViewPoint, item: ObjectModel) -> float:
    """From which side a view sees an object, radians from world x."""
    eye = view.world_from_camera.translation - item.world_from_object.translation
    return math.atan2(float(eye[1]), float(eye[0]))


def _mask(
    scene: ScenePackage, item: ObjectModel, view: ViewPoint, renderer: NativeRenderer
) -> MaskedView | None:
    """An object's mask in a view; None where something hides too much of it."""
    posed = [PosedSplats(scene.room, Pose.identity())]
    posed += [PosedSplats(other.splats, other.world_from_object) for other in scene.objects]
    place = 1 + [other.object_id for other in scene.objects].index(item.object_id)
    front = front_of(renderer, posed, place, view.camera, view.world_from_camera)
    alone = renderer.render([posed[place]], view.camera, view.world_from_camera)
    mask = front.share > SOLID
    if mask.sum() < MIN_SHARE_IN_SIGHT * max(int((alone.alpha > SOLID).sum()), 1):
        return None
    rows, columns = np.nonzero(mask)
    box = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
    left, top, right, bottom = (float(side) for side in box)
    return MaskedView(
        view.name, view.camera, view.world_from_camera, mask, (left, top, right, bottom)
    )
