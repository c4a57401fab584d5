"""From photos or a video to a scene package: the stages in order, each kept once it is done."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from scenes.cameras import Pinhole
from scenes.formats.mesh_glb import read_mesh, write_mesh
from scenes.frames import look_at
from scenes.mesh import CollisionMesh, QrCode
from scenes.package import ScenePackage, save_package
from scenes.package_records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.align.align import align
from scenes.prepare.align.alignment import Alignment, apply_alignment
from scenes.prepare.align.anchors import find_anchors
from scenes.prepare.align.by_length import align_by_length, picked_point
from scenes.prepare.align.unmeasured import guessed_alignment
from scenes.prepare.collision import mesh_of_splats
from scenes.prepare.footage.capture import Capture, CaptureOptions
from scenes.prepare.footage.gather import gather
from scenes.prepare.poses.sfm import SfmReport, reconstruct
from scenes.prepare.poses.sfm_job import SfmOptions
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.stages import WorkFolder
from scenes.prepare.train import checkpoint
from scenes.prepare.train.train import BuiltInTrainer
from scenes.prepare.train.trained_file import load_training, save_training
from scenes.prepare.train.trainer import PRESETS, Preview, Stopwatch, TrainingResult
from scenes.render.native import NativeRenderer

RIG_HEIGHT_M = 1.3
FOOTPRINT_SHARE = 0.02
"""Of the sparse points, left out at each side when the room's extent is found."""
COLLISION_VIEWS = 60
PREVIEWS, COLLISION_FILE = "previews", "room.glb"


@dataclass(frozen=True, slots=True)
class KnownLength:
    """A length measured in the room.

    Attributes:
        metres: the length.
        a_px: pixel (x, y) of its one end by photo, in two photos or more.
        b_px: of its other end.
    """

    metres: float
    a_px: Mapping[str, tuple[float, float]]
    b_px: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True)
class PrepareOptions:
    """How a room is prepared.

    Attributes:
        quality: one of `scenes.prepare.train.trainer.PRESETS`.
        sides_m: printed side of the codes: one for all, or by payload. None ignores codes.
        known_codes: codes whose poses in the world are known; then that is the room's world.
        known_length: tells the scale where there are no codes; None guesses it.
        capture: how frames are chosen.
        sfm: how they are placed.
        seed: decides everything random.
        collision: whether a collision mesh is made.

    Raises:
        ValueError: there is no such quality.
    """

    quality: str = "default"
    sides_m: Mapping[str, float] | float | None = None
    known_codes: tuple[QrCode, ...] = ()
    known_length: KnownLength | None = None
    capture: CaptureOptions = field(default_factory=CaptureOptions)
    sfm: SfmOptions = field(default_factory=SfmOptions)
    seed: int = 0
    collision: bool = True

    def __post_init__(self) -> None:
        if self.quality not in PRESETS:
            raise ValueError(
                f"quality {self.quality!r}: there is none; wanted one of {', '.join(PRESETS)}"
            )


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
    """

    package: ScenePackage
    capture: Capture
    sfm: SfmReport
    reconstruction: Reconstruction
    alignment: Alignment
    training: TrainingResult


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
        ValueError: codes contradict each other, or the package has no place.
        OSError: the disk is full; finished stages are kept.
        Cancelled: as raised by the progress of `work`.
    """
    capture, reconstruction, sfm = _photos_with_poses(source, work, options)
    alignment = _aligned(reconstruction, work, options)
    metric = apply_alignment(reconstruction, alignment)
    training = _trained(metric, work, options, work.seconds)
    mesh = _collision(training, metric, work, renderer) if options.collision else None
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
    save_package(package, target)
    return Prepared(package, capture, sfm, metric, alignment, training)


def _photos_with_poses(
    source: Path, work: WorkFolder, options: PrepareOptions
) -> tuple[Capture, Reconstruction, SfmReport]:
    def frames(folder: Path, progress: Progress) -> Capture:
        return gather(source, folder, options=options.capture, progress=progress)

    capture = work.run(
        "capture",
        {"source": str(source.resolve()), "options": asdict(options.capture)},
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


def _aligned(
    reconstruction: Reconstruction, work: WorkFolder, options: PrepareOptions
) -> Alignment:
    """Codes are quickly found again: nothing is kept but the time that it took."""

    def make(folder: Path, progress: Progress) -> Alignment:
        del folder
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
            return guessed_alignment(reconstruction, rng=rng)
        sightings = find_anchors(reconstruction, progress=progress)
        return align(
            reconstruction,
            sightings,
            sides_m=options.sides_m,
            world_from_codes={code.payload: code.world_from_code for code in options.known_codes},
            rng=rng,
        )

    return work.run(
        "alignment",
        {
            "sides_m": options.sides_m,
            "codes": [str(code) for code in options.known_codes],
            "length": str(options.known_length),
        },
        make=make,
        load=make,
        detail=_alignment_in_words,
    )


def _alignment_in_words(alignment: Alignment) -> str:
    if not alignment.anchors:
        return alignment.warnings[0] if alignment.warnings else "on a measured length"
    codes = ", ".join(
        f"{anchor.payload} ({len(anchor.views)} photos, {anchor.residual_mm:.1f} mm)"
        for anchor in alignment.anchors
    )
    return f"on {codes}"


def _trained(
    metric: Reconstruction, work: WorkFolder, options: PrepareOptions, stopwatch: Stopwatch
) -> TrainingResult:
    trainer = BuiltInTrainer(
        PRESETS[options.quality],
        rng=lambda: np.random.default_rng(options.seed),
        stopwatch=stopwatch,
    )

    def make(folder: Path, progress: Progress) -> TrainingResult:
        previews = folder / PREVIEWS
        previews.mkdir(exist_ok=True)

        def show(preview: Preview) -> None:
            both = np.hstack([preview.photo, preview.picture])
            Image.fromarray(both).save(previews / f"{round(1000 * preview.done):04d}.jpg")

        result = trainer.train(metric, folder, progress=progress, show=show)
        save_training(result, folder)
        checkpoint.remove(folder)
        return result

    return work.run(
        "training",
        {"quality": options.quality, "seed": options.seed},
        make=make,
        load=lambda folder, progress: load_training(folder),
        detail=lambda result: (
            f"{len(result.cloud):,} splats by {result.trainer}, {result.psnr_db:.1f} dB on "
            f"{len(result.held_out)} views kept aside"
        ),
    )


def _collision(
    training: TrainingResult,
    metric: Reconstruction,
    work: WorkFolder,
    renderer: NativeRenderer,
) -> CollisionMesh | None:
    views = [
        (view.camera, view.world_from_camera)
        for view in metric.views
        if isinstance(view.camera, Pinhole)
    ]
    chosen = views[:: max(1, math.ceil(len(views) / COLLISION_VIEWS))]

    def make(folder: Path, progress: Progress) -> CollisionMesh | None:
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

    return work.run(
        "collision",
        {},
        make=make,
        load=load,
        detail=lambda mesh: (
            "none: the splats show no surface that views agree about"
            if mesh is None
            else f"{len(mesh.faces):,} triangles"
        ),
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
