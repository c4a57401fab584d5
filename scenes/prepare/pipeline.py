"""From photos or a video to a scene package: the stages in order, each kept once it is done."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.frames import look_at
from scenes.mesh import CollisionMesh
from scenes.package import ScenePackage, save_package
from scenes.package.records import Stage, ViewPoint, code_to_json
from scenes.pose import Pose
from scenes.prepare.align.alignment import Alignment, apply_alignment
from scenes.prepare.align.axis_scale import AxisScale, measured_axis_scale
from scenes.prepare.align.metric import alignment_in_words, metric_alignment
from scenes.prepare.align.saved_alignment import load_alignment, save_alignment
from scenes.prepare.collision_stages import collision_mesh
from scenes.prepare.cutout.remainder.floaters import remove_floaters
from scenes.prepare.footage.capture import Capture
from scenes.prepare.footage.gather import capture_key, gather
from scenes.prepare.options import BUILT_IN, KnownObject, PrepareOptions
from scenes.prepare.outdoor_points import with_outdoor_points
from scenes.prepare.poses.given_poses import as_capture, as_report, import_poses, load_imported
from scenes.prepare.poses.sfm.run import SfmReport, reconstruct
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction, load_reconstruction, save_reconstruction
from scenes.prepare.room_splats import import_splats, train_room, trainer_of
from scenes.prepare.stages import WorkFolder, stamps
from scenes.prepare.train import checkpoint
from scenes.prepare.train.train import BUILT_IN_VERSION
from scenes.prepare.train.trained_file import load_training, save_training
from scenes.prepare.train.trainer import PRESETS, TrainingResult
from scenes.quad import QrCode
from scenes.render.native import NativeRenderer

RIG_HEIGHT_M = 1.3
"""Height of the 360° camera over the floor's middle until one is placed, metres."""
FOOTPRINT_SHARE = 0.02
"""Of the sparse points, left out at each side when the room's extent is found."""
TRAINING = "training"
POINTS_FOLDER = "points"
OUTDOOR_POINTS = 30_000
"""To start training from; structure from motion leaves a thousand of a street."""


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """A room, and how it came about.

    Attributes:
        package: what was saved.
        capture: the frames it was made of.
        sfm: how they found their places.
        reconstruction: photos with poses and sparse points, in world metres.
        alignment: how scale, up and origin were found.
        training: the splats and how well views that were kept aside are drawn.
        floaters: stray splats that were taken out of the room; undoing the cut brings them back.
        axis_scale: what the codes' sides would have each axis stretched by; None without codes. It
            was done only if the options say so.
    """

    package: ScenePackage
    capture: Capture
    sfm: SfmReport
    reconstruction: Reconstruction
    alignment: Alignment
    training: TrainingResult
    floaters: int
    axis_scale: AxisScale | None = None


def prepare(
    source: Path,
    target: Path,
    *,
    work: WorkFolder,
    options: PrepareOptions,
    renderer: NativeRenderer,
) -> Prepared:
    """Make a scene package of a video or photos.

    Args:
        source: a video file or a folder of photos; only read.
        target: the package's folder; replaced if it is a package.
        work: keeps finished stages, so that a second call goes on where the first one ended.
        options: see `PrepareOptions`.
        renderer: draws previews and depth.

    Raises:
        CaptureError: the pictures cannot become a room; says what to film instead.
        ValueError: codes contradict each other, what was given does not fit the photos, or the
            package has no place.
        OSError: the disk is full; finished stages are kept.
        Cancelled: as raised by the progress of `work`.
    """
    if options.poses is None:
        capture, reconstruction, sfm = _photos_with_poses(source, work, options)
    else:
        capture, reconstruction, sfm = _photos_with_given_poses(
            source, options.poses, work, options
        )
    alignment = _align(reconstruction, work, options)
    metric = apply_alignment(reconstruction, alignment)
    if options.splats is None:
        training = _train(_add_outdoor_points(metric, work, options), work, options)
    else:
        training = _import(options.splats, reconstruction, alignment, work, options, renderer)
    mesh = None
    if options.collision:
        mesh = collision_mesh(training, metric, work, options, renderer)
    stretch = measured_axis_scale(alignment) if alignment.anchors else None
    if options.per_axis and stretch is not None:
        work.log.append(Stage("scale per axis", stretch.warning()))
        metric, alignment = stretch.moved_reconstruction(metric), stretch.moved_alignment(alignment)
        training = replace(training, cloud=stretch.moved_cloud(training.cloud))
        mesh = None if mesh is None else stretch.moved_mesh(mesh)
    package = _package(target.stem, training, metric, alignment, mesh, work)
    floaters = 0
    if not options.keep_floaters:
        package, floaters = remove_floaters(package)
    save_package(package, target)
    return Prepared(package, capture, sfm, metric, alignment, training, floaters, stretch)


def _package(
    name: str,
    training: TrainingResult,
    metric: Reconstruction,
    alignment: Alignment,
    mesh: CollisionMesh | None,
    work: WorkFolder,
) -> ScenePackage:
    footprint = _footprint(metric)
    return ScenePackage(
        name=name,
        room=training.cloud,
        objects=(),
        codes=tuple(QrCode(a.payload, a.side_m, a.world_from_code) for a in alignment.anchors),
        world_from_rig=_default_rig(footprint),
        footprint_m=footprint,
        physical=None,
        stages=tuple(work.log),
        views=tuple(
            ViewPoint(view.name, view.camera, view.world_from_camera) for view in metric.views
        ),
        collision=mesh,
    )


def _photos_with_poses(
    source: Path, work: WorkFolder, options: PrepareOptions
) -> tuple[Capture, Reconstruction, SfmReport]:
    def frames(folder: Path, progress: Progress) -> Capture:
        return gather(source, folder, options=options.capture, progress=progress)

    capture = work.run(
        "capture",
        capture_key(source, options.capture),
        make=frames,
        load=frames,
        detail=lambda result: result.summary(),
    )

    def placed(folder: Path, progress: Progress) -> tuple[Reconstruction, SfmReport]:
        return reconstruct(capture, folder, options=options.sfm, progress=progress)

    reconstruction, report = work.run(
        "poses",
        {"options": asdict(options.sfm)},
        make=placed,
        load=placed,
        detail=lambda result: result[1].summary(),
    )
    return capture, reconstruction, report


def _photos_with_given_poses(
    pictures: Path, poses: Path, work: WorkFolder, options: PrepareOptions
) -> tuple[Capture, Reconstruction, SfmReport]:
    def make(folder: Path, progress: Progress) -> Reconstruction:
        return import_poses(poses, pictures, folder, options=options.sfm, progress=progress)

    reconstruction = work.run(
        "poses",
        {
            "pictures": str(pictures.resolve()),
            "given": stamps(poses),
            "options": asdict(options.sfm),
        },
        make=make,
        load=lambda folder, progress: load_imported(folder),
        detail=lambda found: f"poses of {len(found.views)} photos taken from {poses.name}",
    )
    report = as_report(reconstruction, poses, pictures)
    return as_capture(reconstruction, pictures), reconstruction, report


def _align(reconstruction: Reconstruction, work: WorkFolder, options: PrepareOptions) -> Alignment:
    def make(folder: Path, progress: Progress) -> Alignment:
        alignment = metric_alignment(reconstruction, options, progress)
        save_alignment(alignment, folder)
        return alignment

    return work.run(
        "alignment",
        {
            "sides_m": options.sides_m,
            "codes": [code_to_json(code) for code in options.known_codes],
            "length": None if options.known_length is None else asdict(options.known_length),
            "metric": options.metric_poses,
            "seed": options.seed,
            **_object_key(options.known_object),
        },
        make=make,
        load=lambda folder, progress: load_alignment(folder),
        detail=alignment_in_words,
    )


def _object_key(known: KnownObject | None) -> dict[str, Any]:
    """Nothing without an object, so that what was finished before there were any stays finished."""
    if known is None:
        return {}
    return {"object": [known.points_m.tolist(), dict(known.boxes_px)]}


def _add_outdoor_points(
    metric: Reconstruction, work: WorkFolder, options: PrepareOptions
) -> Reconstruction:
    """Only what is trained sees them: scale, floor and footprint rest on the sparse points."""
    every = PRESETS[options.quality].held_out_every

    def make(folder: Path, progress: Progress) -> Reconstruction:
        found = with_outdoor_points(
            metric,
            OUTDOOR_POINTS,
            held_out_every=every,
            rng=np.random.default_rng(options.seed),
            progress=progress,
        )
        save_reconstruction(found, folder / POINTS_FOLDER)
        return found

    def detail(found: Reconstruction) -> str:
        added = len(found.points) - len(metric.points)
        return f"{added:,} points" if added else "none: the photos show a room"

    return work.run(
        "outdoor points",
        {"wanted": OUTDOOR_POINTS, "held_out_every": every, "seed": options.seed},
        make=make,
        load=lambda folder, progress: load_reconstruction(folder / POINTS_FOLDER),
        detail=detail,
    )


def _train(metric: Reconstruction, work: WorkFolder, options: PrepareOptions) -> TrainingResult:
    def make(folder: Path, progress: Progress) -> TrainingResult:
        trainer = trainer_of(options, work.seconds)
        result = train_room(metric, folder, trainer=trainer, progress=progress)
        save_training(result, folder)
        checkpoint.remove(folder)
        return result

    return work.run(
        TRAINING,
        {
            "quality": options.quality,
            "steps": options.steps,
            "seed": options.seed,
            "trainer": BUILT_IN_VERSION if options.trainer == BUILT_IN else options.trainer,
            "program": str(options.program),
        },
        make=make,
        load=lambda folder, progress: load_training(folder),
        detail=_training_in_words,
    )


def _import(
    file: Path,
    reconstruction: Reconstruction,
    alignment: Alignment,
    work: WorkFolder,
    options: PrepareOptions,
    renderer: NativeRenderer,
) -> TrainingResult:
    def make(folder: Path, progress: Progress) -> TrainingResult:
        result = import_splats(
            file, reconstruction, alignment, options=options, renderer=renderer, progress=progress
        )
        save_training(result, folder)
        return result

    return work.run(
        TRAINING,
        {"splats": stamps(file), "quality": options.quality},
        make=make,
        load=lambda folder, progress: load_training(folder),
        detail=_training_in_words,
    )


def _training_in_words(result: TrainingResult) -> str:
    return (
        f"{len(result.cloud):,} splats by {result.trainer}, {result.psnr_db:.1f} dB on "
        f"{len(result.held_out)} views kept aside"
    )


def _footprint(metric: Reconstruction) -> NDArray[np.float64]:
    """(2, 2) lowest and highest corner (x, y) of where there is something, metres."""
    points = metric.points[:, :2]
    if not len(points):
        points = np.stack([view.world_from_camera.translation[:2] for view in metric.views])
    return np.quantile(points, (FOOTPRINT_SHARE, 1.0 - FOOTPRINT_SHARE), axis=0)


def _default_rig(footprint_m: NDArray[np.float64]) -> Pose:
    """The middle of the room at chest height, looking north, until the camera is placed."""
    middle = np.array([*footprint_m.mean(axis=0), RIG_HEIGHT_M])
    return look_at(middle, middle + np.array([0.0, 1.0, 0.0]))
