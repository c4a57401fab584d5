"""A built-in room is filmed, prepared, and held against the truth.

The truth (the phone's poses, the room's meshes) judges; the preparation never sees it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cutouts import CutoutScore, score_cutouts
from benchmarks.evaluate.true_labels import triangles_of
from scenes.mesh import PhysicalRoom
from scenes.package import load_package
from scenes.prepare.align.similarity import similarity_from_points
from scenes.prepare.options import PrepareOptions
from scenes.prepare.pipeline import Prepared, prepare
from scenes.prepare.reconstruction import Reconstruction, View, read_picture
from scenes.prepare.stages import open_work_folder
from scenes.prepare.train.train import BuiltInTrainer
from scenes.prepare.train.trainer import PRESETS, TrainingResult
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.samples import sample_room
from sim.phone.capture import IMAGES, Capture
from sim.phone.phone import SAMPLE_CAPTURE, TRAINING_SET, PhoneOptions, film
from studio.console.progress import Progress, StageProgress
from studio.console.rows import Row, at_least, at_most
from studio.evaluate.verdict import preview_min

WALL_BAR_MIN = 8.0
PREVIEW_BAR_MIN = 3.0
PSNR_BAR_DB = 32.0
ALIGNMENT_BAR_MM = 5.0
IOU_BAR = 0.95
COLLISION_BAR_CM = 2.0
PROBE_DISTANCE_M = 5.0
PROBES = 200
MAX_PLACES, MIN_SEEN = 4000, 3
DEPTH_AGREEMENT = 0.05
PLACE_SPREAD_M = 0.02
"""True cameras that see a point farther apart than this see an edge."""
BOUND = 0.95
SPARSE_POINTS, SPARSE_NOISE_M = 20_000, 0.002
HELD_OUT_EVERY = 9
"""Of the training set's 72 photos, 8 are kept aside."""

FloatArray = NDArray[np.float64]


def evaluate(
    name: str,
    folder: Path,
    *,
    seed: int,
    tables: set[str],
    progress: Progress,
    clock: Callable[[], float],
) -> list[Row]:
    """All rows that the tables ask for; captures and packages stay in `folder`."""
    room = sample_room(name)
    renderer = NativeRenderer()
    rows: list[Row] = []
    if tables & {"prepare", "cut"}:
        truth = _filmed(room, folder / "capture", "sample capture", seed, progress)
        prepared = _prepared(room, folder, seed, renderer, progress, clock)
        rows += preparation_rows(prepared, truth, room, np.random.default_rng(seed))
        if "cut" in tables:
            progress.begin("cutting out objects")
            # Through the disk, so that what is cut is what any user would open.
            package = load_package(folder / f"{name}.gnx")
            scores = score_cutouts(
                package, room, prepared, renderer=renderer, folder=folder, progress=progress
            )
            progress.finish(f"{len(scores)} objects")
            rows += cut_rows(scores)
    if "train" in tables:
        rows += training_rows(room, folder / "training", seed, progress, clock)
    return rows


def preparation_rows(
    prepared: Prepared, truth: Capture, room: PhysicalRoom, rng: np.random.Generator
) -> list[Row]:
    """Time, and how far the metric world is from the true one."""
    minutes = sum(stage.seconds or 0.0 for stage in prepared.package.stages) / 60
    errors_m, bounds_m = alignment_errors(prepared, truth, room, rng)
    inside = float((errors_m <= bounds_m).mean())
    return [
        at_most("prepare.wall_min", minutes, "min", bar=WALL_BAR_MIN),
        at_most("prepare.preview_min", preview_min(prepared), "min", bar=PREVIEW_BAR_MIN),
        at_most(
            "prepare.alignment_mm.median",
            1000 * float(np.median(errors_m)),
            "mm",
            bar=ALIGNMENT_BAR_MM,
            spread=1000 * float(np.subtract(*np.percentile(errors_m, (75, 25)))),
        ),
        at_least("prepare.alignment.inside_95", inside, "", bar=BOUND),
        Row("prepare.placed", len(prepared.sfm.placed) / len(prepared.capture.frames), ""),
        Row("prepare.capture_psnr_db", prepared.training.psnr_db, "dB"),
    ]


def alignment_errors(
    prepared: Prepared, truth: Capture, room: PhysicalRoom, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """How far points of the prepared world are from where they truly are, and the 95 % bounds.

    The best similarity from the prepared sparse points to their true places says where the
    reconstruction should lie; what remains between it and the alignment is the alignment's error,
    here at points five metres from the codes.

    Returns:
        (N,) errors and (N,) bounds, metres.
    """
    points, places = true_places(prepared.reconstruction, truth, room, rng)
    true_from_world = similarity_from_points(places, points)
    probes = _probes(prepared, rng)
    errors = np.linalg.norm(true_from_world @ probes - probes, axis=1)
    return errors, prepared.alignment.predicted_error_m(probes, bound=BOUND)


def true_places(
    reconstruction: Reconstruction, truth: Capture, room: PhysicalRoom, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Sparse points as prepared, and where the true cameras see them on the true meshes.

    Returns:
        (N, 3) prepared and (N, 3) true places; points that the true cameras do not agree about
        (on an edge, or hidden) are left out.
    """
    scene = RayScene(triangles_of(room))
    true = {shot.name: shot.world_from_camera for shot in truth.shots}
    chosen = rng.permutation(len(reconstruction.points))[:MAX_PLACES]
    points = reconstruction.points[chosen]
    seen = np.full((len(points), len(reconstruction.views), 3), np.nan)
    for number, view in enumerate(reconstruction.views):
        world_from_true = true.get(view.name)
        if world_from_true is None:
            continue
        in_camera = view.world_from_camera.inverse() @ points
        pixels, valid = view.camera.project(in_camera)
        rays = view.camera.unproject(pixels[valid]) @ world_from_true.rotation.T
        eyes = np.broadcast_to(world_from_true.translation, rays.shape)
        distance = scene.cast(eyes, rays).distance
        expected = np.linalg.norm(in_camera[valid], axis=1)
        agrees = np.abs(distance / expected - 1) < DEPTH_AGREEMENT
        rows = np.flatnonzero(valid)[agrees]
        seen[rows, number] = eyes[agrees] + rays[agrees] * distance[agrees, None]
    count = np.isfinite(seen[..., 0]).sum(axis=1)
    often = count >= MIN_SEEN
    places = np.nanmedian(seen[often], axis=1)
    spread = np.nanmedian(np.linalg.norm(seen[often] - places[:, None], axis=2), axis=1)
    sure = spread < PLACE_SPREAD_M
    return points[often][sure], places[sure]


def _probes(prepared: Prepared, rng: np.random.Generator) -> FloatArray:
    """(N, 3) points at the probe distance from the codes' middle, at heights of a room."""
    codes = np.stack([a.world_from_code.translation for a in prepared.alignment.anchors])
    middle = codes.mean(axis=0)
    turn = rng.uniform(0, 2 * np.pi, PROBES)
    height = rng.uniform(0.0, 2.0, PROBES)
    across = np.sqrt(np.maximum(PROBE_DISTANCE_M**2 - (height - middle[2]) ** 2, 0.0))
    return np.stack(
        [middle[0] + across * np.cos(turn), middle[1] + across * np.sin(turn), height], axis=1
    )


def training_rows(
    room: PhysicalRoom, folder: Path, seed: int, progress: Progress, clock: Callable[[], float]
) -> list[Row]:
    """PSNR of held-out views after the preview and the default training, from true poses."""
    truth = _filmed(room, folder, "training set", seed, progress, options=TRAINING_SET)
    reconstruction = posed_photos(room, truth, folder, np.random.default_rng(seed))
    rows = []
    minutes = 0.0
    for name, preset, bar in (
        ("prepare.psnr_db_30s", "preview", None),
        ("prepare.psnr_db", "default", PSNR_BAR_DB),
    ):
        progress.begin(f"training, {preset} quality")
        result = train_with(reconstruction, preset, folder / preset, seed, progress, clock)
        scores = [score.psnr_db for score in result.held_out]
        progress.finish(f"{np.mean(scores):.2f} dB")
        rows.append(
            at_least(name, float(np.mean(scores)), "dB", bar=bar, spread=float(np.std(scores)))
        )
        rows.append(Row(f"{name}.ssim", float(np.mean([s.ssim for s in result.held_out])), ""))
        minutes = result.history[-1].seconds / 60
    rows.append(Row("prepare.train_min", minutes, "min"))
    return rows


def posed_photos(
    room: PhysicalRoom, truth: Capture, folder: Path, rng: np.random.Generator
) -> Reconstruction:
    """The photos at their true poses, with as many and as exact points as a good SfM finds."""
    views = tuple(
        View(shot.name, folder / IMAGES / shot.name, truth.camera, shot.world_from_camera)
        for shot in truth.shots
    )
    scene = RayScene(triangles_of(room))
    points, colours = [], []
    share = SPARSE_POINTS // len(views)
    size = np.array([truth.camera.width_px, truth.camera.height_px])
    for view in views:
        pixels = rng.uniform(0, 1, (share, 2)) * size
        rays = view.camera.unproject(pixels) @ view.world_from_camera.rotation.T
        eyes = np.broadcast_to(view.world_from_camera.translation, rays.shape)
        hits = scene.cast(eyes, rays)
        hit = hits.triangle >= 0
        places = eyes[hit] + rays[hit] * hits.distance[hit, None]
        points.append(places + rng.normal(scale=SPARSE_NOISE_M, size=places.shape))
        column, row = np.floor(pixels[hit]).astype(int).T
        colours.append(read_picture(view)[row, column])
    count = sum(len(part) for part in points)
    return Reconstruction(
        views, np.concatenate(points), np.concatenate(colours), np.zeros(count, dtype=np.float32)
    )


def cut_rows(scores: Sequence[CutoutScore]) -> list[Row]:
    """The worst object's overlap and box, and whether every cut was exact."""
    worst_cm = max(score.box_error_cm for score in scores)
    return [
        at_least("prepare.cut.iou.min", min(s.iou for s in scores), "", bar=IOU_BAR),
        at_least("prepare.cut.exact", float(all(s.exact for s in scores)), "", bar=1.0),
        at_most("prepare.collision_cm.max", worst_cm, "cm", bar=COLLISION_BAR_CM),
        Row("prepare.cut.iou_ties_by_light.min", min(s.iou_ties_by_light for s in scores), ""),
        Row("prepare.cut.iou_by_light.min", min(s.iou_by_light for s in scores), ""),
        Row("prepare.cut.truths_agree.min", min(s.truths_agree for s in scores), ""),
        *(Row(f"prepare.cut.{s.object_id}.iou", s.iou, "") for s in scores),
        *(
            Row(f"prepare.cut.{s.object_id}.iou_ties_by_light", s.iou_ties_by_light, "")
            for s in scores
        ),
        *(Row(f"prepare.cut.{s.object_id}.iou_by_light", s.iou_by_light, "") for s in scores),
        *(Row(f"prepare.cut.{s.object_id}.box_cm", s.box_error_cm, "cm") for s in scores),
    ]


def _filmed(
    room: PhysicalRoom,
    folder: Path,
    what: str,
    seed: int,
    progress: Progress,
    options: PhoneOptions = SAMPLE_CAPTURE,
) -> Capture:
    progress.begin(f"filming the {what}")
    rng = np.random.default_rng(seed)
    truth = film(room, folder, rng=rng, options=options, progress=progress.advance)
    progress.finish(f"{len(truth.shots)} photos")
    return truth


def _prepared(
    room: PhysicalRoom,
    folder: Path,
    seed: int,
    renderer: NativeRenderer,
    progress: Progress,
    clock: Callable[[], float],
) -> Prepared:
    stages = StageProgress(progress)
    work = open_work_folder(folder / f"{room.name}.gnx.prepare", seconds=clock, progress=stages)
    # The codes' poses make the prepared world the physical one: each splat gets a true owner.
    options = PrepareOptions(
        sides_m={code.payload: code.side_m for code in room.codes},
        known_codes=room.codes,
        seed=seed,
    )
    prepared = prepare(
        folder / "capture" / IMAGES,
        folder / f"{room.name}.gnx",
        work=work,
        options=options,
        renderer=renderer,
    )
    stages.finish()
    return prepared


def train_with(
    reconstruction: Reconstruction,
    preset: str,
    folder: Path,
    seed: int,
    progress: Progress,
    clock: Callable[[], float],
) -> TrainingResult:
    """A training as `nexus prepare` does it, with the truth's choice of views kept aside."""
    options = replace(PRESETS[preset], held_out_every=HELD_OUT_EVERY)
    trainer = BuiltInTrainer(options, rng=lambda: np.random.default_rng(seed), stopwatch=clock)
    folder.mkdir(parents=True, exist_ok=True)
    return trainer.train(
        reconstruction, folder, progress=lambda done, note: progress.advance(done, note)
    )
