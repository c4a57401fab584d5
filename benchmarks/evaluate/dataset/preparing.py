"""A dataset's room as the product makes it: prepared and cut with its defaults, then judged."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from benchmarks.evaluate.cutouts import MIN_SHARE, PADDING_PX, from_different_sides, overlap
from benchmarks.evaluate.dataset.layout import Dataset, DatasetObject
from benchmarks.evaluate.true_labels import labels_by_mesh
from scenes.cameras import Pinhole
from scenes.package import ScenePackage, is_package, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.align.codes.triangulate import UNIT_CORNERS
from scenes.prepare.align.similarity import similarity_from_points
from scenes.prepare.cutout.cutout import cut_out
from scenes.prepare.cutout.marks.masks import GrabCutMasks, Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView, masked_views
from scenes.prepare.options import PrepareOptions
from scenes.prepare.pipeline import Prepared, prepare
from scenes.prepare.reconstruction import View, read_picture
from scenes.prepare.stages import open_work_folder
from scenes.render.native import NativeRenderer
from studio.console.progress import Progress, StageProgress

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class CutResult:
    """How one object was cut out.

    Attributes:
        object_id: of the dataset.
        iou: overlap of its splats with those nearest to its mesh; 0 where the cut was refused.
        box_cm: largest error of the box's extents; its whole size where the cut was refused.
        seconds: how long the cut took.
    """

    object_id: str
    iou: float
    box_cm: float
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class PreparedDataset:
    """The product's copy of a dataset's room.

    Attributes:
        package: the room with its movable objects.
        true_from_package: rigid, from the dataset's camera poses; the dataset judges scale as well.
        wall_min: minutes that the preparation took.
        psnr_db: of views that the training never saw.
        placed: share of the photos that found their place.
        alignment_mm: distance of the check code's corners, in the package's metric world, from
            where they truly are once the other codes' corners lie on theirs. None without such a
            code in the photos.
        cuts: one per object of the dataset.
    """

    package: ScenePackage
    true_from_package: Pose
    wall_min: float
    psnr_db: float
    placed: float
    alignment_mm: float | None
    cuts: tuple[CutResult, ...]


def prepare_dataset(
    dataset: Dataset,
    folder: Path,
    *,
    quality: str,
    steps: int | None,
    seed: int,
    progress: Progress,
    clock: Callable[[], float],
) -> PreparedDataset:
    """Prepare the photos and cut out every object, with the product's defaults.

    Args:
        dataset: the room.
        folder: keeps the finished stages and the package.
        quality: of the training.
        steps: ends the training after so many; None for the quality's own budget.
        seed: decides everything random.
        progress: shows what is under way.
        clock: seconds, for the durations.

    Raises:
        ValueError: the photos cannot become a room; says why.
    """
    dataset.photo_camera()  # says so where there are no photos
    renderer = NativeRenderer()
    stages = StageProgress(progress)
    work = open_work_folder(folder / "room.gnx.prepare", seconds=clock, progress=stages)
    options = PrepareOptions(quality=quality, steps=steps, sides_m=dataset.code_side_m, seed=seed)
    prepared = prepare(
        dataset.photos, folder / "room.gnx", work=work, options=options, renderer=renderer
    )
    stages.finish()
    true_from_package = _rigid(prepared, dataset)
    package, cuts = _all_cut(
        dataset, prepared, folder / "cut.gnx", true_from_package, renderer, progress, clock
    )
    minutes = sum(stage.seconds or 0.0 for stage in prepared.package.stages) / 60
    count = len(prepared.sfm.placed) + len(prepared.sfm.failed)
    return PreparedDataset(
        package=package,
        true_from_package=true_from_package,
        wall_min=minutes,
        psnr_db=prepared.training.psnr_db,
        placed=len(prepared.sfm.placed) / count,
        alignment_mm=_alignment_mm(prepared, dataset),
        cuts=tuple(cuts),
    )


def _all_cut(
    dataset: Dataset,
    prepared: Prepared,
    folder: Path,
    true_from_package: Pose,
    renderer: NativeRenderer,
    progress: Progress,
    clock: Callable[[], float],
) -> tuple[ScenePackage, list[CutResult]]:
    """The package with every object cut out, and how well each was; kept for the next run.

    Args:
        dataset: the room.
        prepared: the preparation.
        folder: keeps the package with its cuts; what it holds of another preparation is replaced.
        true_from_package: rigid motion between the two worlds.
        renderer: draws splats.
        progress: shows what is under way.
        clock: seconds, for the durations.
    """
    progress.begin("cutting out objects")
    figures, made_of = folder.with_suffix(".json"), _digest(prepared.package)
    if figures.is_file():
        known = json.loads(figures.read_text(encoding="utf-8"))
        if known["room"] == made_of and is_package(folder):
            progress.finish("kept from the run before")
            return load_package(folder), [CutResult(**cut) for cut in known["cuts"]]
    package, cuts = prepared.package, []
    for number, item in enumerate(dataset.objects.values()):
        progress.advance(number / len(dataset.objects), item.object_id)
        package, cut = _cut(package, item, dataset, prepared, true_from_package, renderer, clock)
        cuts.append(cut)
    progress.finish(f"{len(package.objects)} of {len(dataset.objects)} objects")
    save_package(package, folder)
    kept = {"room": made_of, "cuts": [asdict(cut) for cut in cuts]}
    figures.write_text(json.dumps(kept, indent=2), encoding="utf-8")
    return package, cuts


def _digest(package: ScenePackage) -> str:
    """Of the room's splats: cuts of another training do not belong to it."""
    return hashlib.sha256(np.ascontiguousarray(package.room.means).tobytes()).hexdigest()


def _rigid(prepared: Prepared, dataset: Dataset) -> Pose:
    """`true_from_package`: the rigid motion that lays the prepared cameras onto the true ones.

    Raises:
        ValueError: fewer than three photos are in both.
    """
    return rigid_from_cameras(
        prepared.reconstruction.views, dataset.world_from_camera, where=str(dataset.folder)
    )


def rigid_from_cameras(
    views: Sequence[View | ViewPoint], world_from_camera: Mapping[str, Pose], *, where: str
) -> Pose:
    """`true_from_package`: the rigid motion that lays prepared cameras onto the true ones.

    Args:
        views: as prepared.
        world_from_camera: true poses, by photo.
        where: the photos come from, for messages.

    Raises:
        ValueError: fewer than three photos are in both.
    """
    views = [view for view in views if view.name in world_from_camera]
    if len(views) < 3:
        raise ValueError(
            f"{where}: {len(views)} prepared photos have a true pose, wanted 3 or more; "
            "are the names of the poses those of the photos?"
        )
    places = np.stack([view.world_from_camera.translation for view in views])
    truth = np.stack([world_from_camera[view.name].translation for view in views])
    turned = similarity_from_points(truth, places)
    shift = truth.mean(axis=0) - turned.rotation @ places.mean(axis=0)
    return Pose(turned.rotation, shift)


def _alignment_mm(prepared: Prepared, dataset: Dataset) -> float | None:
    """Largest corner error of a code that was left out of the fit of the two worlds."""
    corners = {a.payload: _corners(a.world_from_code, a.side_m) for a in prepared.alignment.anchors}
    check = [name for name in dataset.check_codes if name in corners]
    fitted = [name for name in corners if name in dataset.code_corners_m and name not in check]
    if not check or not fitted:
        return None
    measured = np.concatenate([corners[name] for name in fitted])
    truth = np.concatenate([dataset.code_corners_m[name] for name in fitted])
    turned = similarity_from_points(truth, measured)
    shift = truth.mean(axis=0) - turned.rotation @ measured.mean(axis=0)
    errors = [
        np.linalg.norm(
            corners[name] @ turned.rotation.T + shift - dataset.code_corners_m[name], axis=1
        )
        for name in check
    ]
    return 1000.0 * float(np.concatenate(errors).max())


def _corners(world_from_code: Pose, side_m: float) -> NDArray[np.float64]:
    """(4, 3) of a printed code, in a dataset's order."""
    return world_from_code @ (side_m * UNIT_CORNERS)


def _cut(
    package: ScenePackage,
    item: DatasetObject,
    dataset: Dataset,
    prepared: Prepared,
    true_from_package: Pose,
    renderer: NativeRenderer,
    clock: Callable[[], float],
) -> tuple[ScenePackage, CutResult]:
    """The package with one more object, and how well it was cut."""
    owner = labels_by_mesh(package.room, true_parts(dataset, true_from_package.inverse()))
    number = list(dataset.objects).index(item.object_id)
    began = clock()
    try:
        views = _marked(item, dataset, prepared.reconstruction.views)
        masked = masked_views(package.room, views, masks=GrabCutMasks(), renderer=renderer)
        done = cut_out(
            package,
            masked,
            object_id=item.object_id,
            name=item.object_id,
            kind=item.kind,
            renderer=renderer,
        )
    except ValueError as refused:
        # What cannot be cut is judged as missing; the other objects are still tried.
        log.warning("%s was not cut out: %s", item.object_id, refused)
        box_cm = 100.0 * float(item.box_m.max())
        return package, CutResult(item.object_id, 0.0, box_cm, clock() - began)
    seconds = clock() - began
    last = done.package.cuts[-1]
    found = np.zeros(len(package.room), dtype=bool)
    found[last.places[last.is_object]] = True
    sides = np.sort(done.box.size_m[:2]) - np.sort(item.box_m[:2])
    error_m = max(float(np.abs(sides).max()), abs(float(done.box.size_m[2] - item.box_m[2])))
    return done.package, CutResult(
        item.object_id, overlap(found, owner == number), 100.0 * error_m, seconds
    )


def true_parts(dataset: Dataset, package_from_true: Pose) -> list[NDArray[np.float64]]:
    """(T, 3, 3) of the room, then of each object where the capture saw it, in package metres."""
    parts = [triangles_in(dataset.room_mesh)]
    for item in dataset.objects.values():
        parts.append(item.world_from_object @ triangles_in(item.mesh))
    return [package_from_true @ part for part in parts]


def triangles_in(path: Path) -> NDArray[np.float64]:
    """(T, 3, 3) triangles of a mesh file.

    Raises:
        ValueError: it holds no triangle.
    """
    loaded = trimesh.load(path, force="mesh", process=False, skip_materials=True)
    if not isinstance(loaded, trimesh.Trimesh) or not len(loaded.faces):
        raise ValueError(f"{path}: no triangle in it")
    return np.asarray(loaded.vertices, dtype=np.float64)[np.asarray(loaded.faces)]


def _marked(item: DatasetObject, dataset: Dataset, views: tuple[View, ...]) -> list[PromptedView]:
    """Up to three photos from different sides, each with a box as a careful person draws it.

    Raises:
        ValueError: no photo shows the object whole.
    """
    ranked = []
    for view in views:
        seen = dataset.photo_visible.get(view.name, {}).get(item.object_id)
        if seen is None or seen.fraction < MIN_SHARE or not isinstance(view.camera, Pinhole):
            continue
        box = _box(dataset, view, item.object_id)
        if box is None:
            continue
        eye = dataset.world_from_camera[view.name].translation - item.world_from_object.translation
        area = (box[2] - box[0]) * (box[3] - box[1]) * seen.fraction
        ranked.append((area, float(np.arctan2(eye[1], eye[0])), view, box))
    ranked.sort(key=lambda entry: -entry[0])
    chosen = []
    for place in from_different_sides([turn for _, turn, _, _ in ranked]):
        _, _, view, box = ranked[place]
        prompt, picture = Prompt(box_px=box), read_picture(view)
        chosen.append(PromptedView(view.name, view.camera, view.world_from_camera, prompt, picture))
    if not chosen:
        raise ValueError(f"no photo shows {MIN_SHARE:.0%} of {item.object_id} or more")
    return chosen


def _box(dataset: Dataset, view: View, object_id: str) -> tuple[float, float, float, float] | None:
    """Padded box (left, top, right, bottom) in a prepared photo's pixels; None at its edge."""
    labels = dataset.photo_labels(view.name)
    rows, columns = np.nonzero(labels == dataset.label_of[object_id])
    height, width = labels.shape
    if not len(rows) or rows.min() == 0 or columns.min() == 0:
        return None
    if rows.max() == height - 1 or columns.max() == width - 1:
        return None
    corners = dataset.label_scale * np.array(
        [[columns.min(), rows.min()], [columns.max() + 1, rows.max() + 1]], dtype=np.float64
    )
    # The preparation rectifies photos with the lens it estimated.
    pixels, _ = view.camera.project(dataset.photo_camera().unproject(corners))
    low, high = pixels[0] - PADDING_PX, pixels[1] + PADDING_PX
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
