"""From photos or a video to a scene package: the stages in order, each kept once it is done."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.formats.atomic import write_file
from scenes.formats.mesh_glb import read_mesh, write_mesh
from scenes.frames import look_at
from scenes.mesh import CollisionMesh, QrCode
from scenes.package import ScenePackage, save_package
from scenes.package_records import ViewPoint, code_to_json
from scenes.pose import Pose
from scenes.prepare.align.align import align
from scenes.prepare.align.alignment import Alignment, apply_alignment
from scenes.prepare.align.anchors import find_anchors
from scenes.prepare.align.by_length import align_by_length, picked_point
from scenes.prepare.align.saved_alignment import load_alignment, save_alignment
from scenes.prepare.align.unmeasured import guessed_alignment, stated_alignment
from scenes.prepare.collision import mesh_of_splats
from scenes.prepare.cutout.floaters import remove_floaters
from scenes.prepare.footage.capture import Capture
from scenes.prepare.footage.gather import capture_key, gather
from scenes.prepare.headset_mesh import place_mesh
from scenes.prepare.options import PrepareOptions
from scenes.prepare.poses.given_poses import as_capture, as_report, import_poses, load_imported
from scenes.prepare.poses.sfm import SfmReport, reconstruct
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.room_splats import import_splats, train_room, trainer_of
from scenes.prepare.stages import WorkFolder, stamps
from scenes.prepare.train import checkpoint
from scenes.prepare.train.trained_file import load_training, save_training
from scenes.prepare.train.trainer import TrainingResult
from scenes.render.native import NativeRenderer

RIG_HEIGHT_M = 1.3
FOOTPRINT_SHARE = 0.02
"""Of the sparse points, left out at each side when the room's extent is found."""
COLLISION_VIEWS = 60
TRAINING = "training"
COLLISION_FILE, REGISTRATION_FILE = "room.glb", "registration.txt"


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
    """

    package: ScenePackage
    capture: Capture
    sfm: SfmReport
    reconstruction: Reconstruction
    alignment: Alignment
    training: TrainingResult
    floaters: int


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
    alignment = _aligned(reconstruction, work, options)
    metric = apply_alignment(reconstruction, alignment)
    if options.splats is None:
        training = _trained(metric, work, options)
    else:
        training = _imported(options.splats, reconstruction, alignment, work, options, renderer)
    mesh = _collision(training, metric, work, options, renderer) if options.collision else None
    footprint = _footprint(metric)
    package = ScenePackage(
        name=target.stem,
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
    floaters = 0
    if not options.keep_floaters:
        package, floaters = remove_floaters(package)
    save_package(package, target)
    return Prepared(package, capture, sfm, metric, alignment, training, floaters)


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


def _aligned(
    reconstruction: Reconstruction, work: WorkFolder, options: PrepareOptions
) -> Alignment:
    def make(folder: Path, progress: Progress) -> Alignment:
        alignment = _alignment(reconstruction, options, progress)
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
        },
        make=make,
        load=lambda folder, progress: load_alignment(folder),
        detail=_alignment_in_words,
    )


def _alignment(
    reconstruction: Reconstruction, options: PrepareOptions, progress: Progress
) -> Alignment:
    """By whatever tells the scale: a length, codes, an app's metres, or nothing."""
    rng = np.random.default_rng(options.seed)
    if options.known_length is not None:
        length = options.known_length
        return align_by_length(
            reconstruction,
            picked_point(reconstruction, length.a_px),
            picked_point(reconstruction, length.b_px),
            length_m=length.metres,
            rng=rng,
        )
    if options.sides_m is None:
        return (stated_alignment if options.metric_poses else guessed_alignment)(
            reconstruction, rng=rng
        )
    return align(
        reconstruction,
        find_anchors(reconstruction, progress=progress),
        sides_m=options.sides_m,
        world_from_codes={code.payload: code.world_from_code for code in options.known_codes},
        rng=rng,
    )


def _alignment_in_words(alignment: Alignment) -> str:
    if not alignment.anchors:
        return alignment.warnings[0] if alignment.warnings else "on a measured length"
    codes = ", ".join(
        f"{anchor.payload} ({len(anchor.views)} photos, {anchor.residual_mm:.1f} mm)"
        for anchor in alignment.anchors
    )
    return f"on {codes}"


def _trained(metric: Reconstruction, work: WorkFolder, options: PrepareOptions) -> TrainingResult:
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
            "trainer": options.trainer,
            "program": str(options.program),
        },
        make=make,
        load=lambda folder, progress: load_training(folder),
        detail=_training_in_words,
    )


def _imported(
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


def _collision(
    training: TrainingResult,
    metric: Reconstruction,
    work: WorkFolder,
    options: PrepareOptions,
    renderer: NativeRenderer,
) -> CollisionMesh | None:
    """The splats' own surface, or a headset's mesh laid on it."""
    views = [
        (view.camera, view.world_from_camera)
        for view in metric.views
        if isinstance(view.camera, Pinhole)
    ]
    chosen = views[:: max(1, math.ceil(len(views) / COLLISION_VIEWS))]

    def of_splats(folder: Path, progress: Progress) -> CollisionMesh | None:
        try:
            mesh = mesh_of_splats(training.cloud, chosen, renderer=renderer, progress=progress)
        except ValueError:
            # A room without a hidden mesh can be walked in all the same, so it is not refused.
            return None
        write_mesh(folder / COLLISION_FILE, mesh)
        return mesh

    def load(folder: Path, progress: Progress) -> CollisionMesh | None:
        del progress
        path = folder / COLLISION_FILE
        return read_mesh(path) if path.is_file() else None

    surface = work.run(
        "collision",
        {},
        make=of_splats,
        load=load,
        detail=lambda mesh: (
            "none: the splats show no surface that views agree about"
            if mesh is None
            else f"{len(mesh.faces):,} triangles"
        ),
    )
    if options.headset_mesh is None:
        return surface
    return _headset_mesh(options.headset_mesh, surface, work)


def _headset_mesh(file: Path, surface: CollisionMesh | None, work: WorkFolder) -> CollisionMesh:
    def make(folder: Path, progress: Progress) -> tuple[CollisionMesh, str]:
        if surface is None:
            raise ValueError(
                f"{file}: cannot be laid on the room, whose splats show no surface; train longer "
                "or go without the mesh"
            )
        mesh, registration = place_mesh(read_mesh(file), surface, progress=progress)
        write_mesh(folder / COLLISION_FILE, mesh)
        write_file(folder / REGISTRATION_FILE, [registration.summary().encode()])
        return mesh, registration.summary()

    def load(folder: Path, progress: Progress) -> tuple[CollisionMesh, str]:
        del progress
        words = (folder / REGISTRATION_FILE).read_text(encoding="utf-8")
        return read_mesh(folder / COLLISION_FILE), words

    mesh, _ = work.run(
        "headset mesh",
        {"file": stamps(file)},
        make=make,
        load=load,
        detail=lambda result: f"{len(result[0].faces):,} triangles of {file.name}, {result[1]}",
    )
    return mesh


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
