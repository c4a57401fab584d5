"""Every object of a prepared built-in room, cut out with one box in each of three photos."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.true_labels import (
    between_two,
    labels_by_light,
    object_triangles,
    parts_of,
    static_triangles,
    true_labels,
)
from scenes.cameras import Pinhole, pixel_centres
from scenes.formats.ply import write_ply
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.package import ScenePackage
from scenes.prepare.cutout.cutout import Cutout, cut_out, undo_cut
from scenes.prepare.cutout.marks.masks import GrabCutMasks, Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView, masked_views
from scenes.prepare.pipeline import Prepared
from scenes.prepare.reconstruction import View, read_picture
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from studio.console.progress import Progress

log = logging.getLogger(__name__)

VIEWS = 3
PADDING_PX = 6.0
MIN_SHARE = 0.8
"""A person takes photos in which at least so much of the object is in sight."""
MIN_TURN_RAD = 0.5
"""And that are taken from different sides."""


@dataclass(frozen=True, slots=True)
class CutoutScore:
    """How well an object was cut out.

    Attributes:
        object_id: of the physical object.
        iou: overlap of its splats with those nearest to its mesh, per splat (`true_labels`).
        iou_ties_by_light: the same, but light decides whose splats are that are as near to what it
            touches (`between_two`); by mesh alone they are the room's, though they paint its edge.
        iou_by_light: the same with those whose light falls into its outlines (`labels_by_light`);
            it is kinder: the cut is decided by the same kind of vote.
        truths_agree: overlap of the two truths. Where splats hang off what they paint, a cut that
            is perfect by light has no more than this by mesh.
        box_error_cm: largest error of the box's extents.
        exact: whether undoing the cut gave the same file, byte for byte.
    """

    object_id: str
    iou: float
    iou_ties_by_light: float
    iou_by_light: float
    truths_agree: float
    box_error_cm: float
    exact: bool


def score_cutouts(
    package: ScenePackage,
    room: PhysicalRoom,
    prepared: Prepared,
    *,
    renderer: NativeRenderer,
    folder: Path,
    progress: Progress,
) -> list[CutoutScore]:
    """Cut out one object after the other, each from the room as it was prepared.

    The boxes are those around the object's true outline, padded: what a careful person draws. The
    prepared world must be the physical one. One that is refused has no overlap, and its box is off
    by its whole size.
    """
    by_mesh, parts = true_labels(package.room, room), parts_of(room)
    by_light = labels_by_light(package.room, parts, viewpoints=package.views, renderer=renderer)
    untied = np.where(between_two(package.room, parts), by_light, by_mesh)
    before = _digest(package.room, folder)
    scores = []
    for number, item in enumerate(room.objects):
        progress.advance(number / len(room.objects), item.object_id)
        agree = overlap(by_light == number, by_mesh == number)
        try:
            cut = _cut_by_hand(package, item, room, prepared.reconstruction.views, renderer)
        except ValueError as refused:
            # An object that no photo shows whole is skipped; the others are scored.
            log.warning("%s was not cut out: %s", item.object_id, refused)
            off_cm = 100 * max(item.box_m)
            scores.append(CutoutScore(item.object_id, 0.0, 0.0, 0.0, agree, off_cm, exact=True))
            continue
        last = cut.package.cuts[-1]
        found = np.zeros(len(package.room), dtype=bool)
        found[last.places[last.is_object]] = True
        sizes = np.sort(cut.box.size_m[:2]) - np.sort(item.box_m[:2])
        error_m = max(float(np.abs(sizes).max()), abs(cut.box.size_m[2] - item.box_m[2]))
        scores.append(
            CutoutScore(
                item.object_id,
                overlap(found, by_mesh == number),
                overlap(found, untied == number),
                overlap(found, by_light == number),
                agree,
                100 * error_m,
                _digest(undo_cut(cut.package).room, folder) == before,
            )
        )
    return scores


def _cut_by_hand(
    package: ScenePackage,
    item: PhysicalObject,
    room: PhysicalRoom,
    views: tuple[View, ...],
    renderer: NativeRenderer,
) -> Cutout:
    """The cut that a careful person gets.

    Raises:
        ValueError: no photo shows the object whole, or the cut is refused.
    """
    prompted = [marked(view, outline) for view, outline in photos_of(item, room, views)]
    masked = masked_views(package.room, prompted, masks=GrabCutMasks(), renderer=renderer)
    return cut_out(
        package,
        masked,
        object_id=item.object_id,
        name=item.object_id,
        kind=item.kind,
        renderer=renderer,
    )


def overlap(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    """Intersection over union."""
    return float((a & b).sum() / max((a | b).sum(), 1))


def photos_of(
    item: PhysicalObject, room: PhysicalRoom, views: tuple[View, ...]
) -> list[tuple[View, NDArray[np.bool_]]]:
    """Up to three photos from different sides that show most of an object, with its outline."""
    rest = [static_triangles(room)]
    rest += [object_triangles(other) for other in room.objects if other is not item]
    own, others = RayScene(object_triangles(item)), RayScene(np.concatenate(rest))
    centre = item.world_from_object @ np.array([[0.0, 0.0, 0.5 * item.box_m[2]]])
    ranked = []
    for view in views:
        if not isinstance(view.camera, Pinhole):
            continue
        whole, seen = _outlines(view, own, others)
        touches_edge = whole[0].any() or whole[-1].any() or whole[:, 0].any() or whole[:, -1].any()
        if not whole.any() or touches_edge or seen.sum() < MIN_SHARE * whole.sum():
            continue
        eye = view.world_from_camera.translation - centre[0]
        ranked.append((int(seen.sum()), float(np.arctan2(eye[1], eye[0])), view, seen))
    ranked.sort(key=lambda entry: -entry[0])
    chosen = from_different_sides([turn for _, turn, _, _ in ranked])
    return [ranked[place][2:] for place in chosen]


def from_different_sides(turns_rad: Sequence[float]) -> list[int]:
    """Places of up to `VIEWS` of some photos, the best first, each from another side.

    Args:
        turns_rad: from which direction each photo looks, seen from above; the best first.
    """
    chosen: list[int] = []
    for place, turn in enumerate(turns_rad):
        apart = [abs((turn - turns_rad[other] + np.pi) % (2 * np.pi) - np.pi) for other in chosen]
        if len(chosen) < VIEWS and all(angle > MIN_TURN_RAD for angle in apart):
            chosen.append(place)
    return chosen


def _outlines(
    view: View, own: RayScene, others: RayScene
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(H, W) where the object would be seen if it were alone, and where it is seen."""
    rays = view.camera.unproject(pixel_centres(view.camera)) @ view.world_from_camera.rotation.T
    eyes = np.broadcast_to(view.world_from_camera.translation, rays.shape)
    to_object, to_rest = own.cast(eyes, rays), others.cast(eyes, rays)
    shape = view.camera.height_px, view.camera.width_px
    whole = (to_object.triangle >= 0).reshape(shape)
    return whole, whole & (to_object.distance < to_rest.distance).reshape(shape)


def padded_box(outline: NDArray[np.bool_]) -> tuple[float, float, float, float]:
    """The box (left, top, right, bottom) around an outline (H, W), as a careful person draws it."""
    rows, columns = np.nonzero(outline)
    return (
        float(columns.min()) - PADDING_PX,
        float(rows.min()) - PADDING_PX,
        float(columns.max()) + 1 + PADDING_PX,
        float(rows.max()) + 1 + PADDING_PX,
    )


def marked(view: View, outline: NDArray[np.bool_]) -> PromptedView:
    """A photo with a box around an outline, padded as a careful person draws it."""
    box = padded_box(outline)
    assert isinstance(view.camera, Pinhole)
    return PromptedView(
        view.name, view.camera, view.world_from_camera, Prompt(box_px=box), read_picture(view)
    )


def _digest(cloud: SplatCloud, folder: Path) -> str:
    path = folder / "digest.ply"
    write_ply(path, cloud)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    path.unlink()
    return digest
