# pyright: standard
"""Poses and points from matches: by a mapper, by given poses, or a finished model as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from PIL import Image

from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.poses.photo_files import check_left_out, find_photo
from scenes.prepare.poses.pose_uncertainty import pose_uncertainty_px
from scenes.prepare.poses.sfm.job import Attempt, Job, write_json
from scenes.prepare.poses.sfm.session import MAPPING_FILE, Refused, Worker, open_database

ENOUGH = 0.9
"""Share of placed pictures at which no other mapper is tried."""
MIN_POINTS = 20
"""A picture that sees fewer points has no place that can be relied on."""
KNOWN_POSES = "known poses"
LOSS_SCALE_PX = 0.5
"""Scale of the robust loss in the last adjustment, px."""
REFINEMENT_STEPS = 60
"""Steps of the last adjustment at most."""
WRONG_MATCH_PX = 2.0
"""Reprojection error beyond which a match is wrong, px."""
MIN_ANGLE_DEG = 1.5
"""Angle between rays below which a point's distance is not known, degrees."""
MAX_UNCERTAINTY_PX = 1.0
"""A picture that may be off by more blurs what all others show."""
HELD_BY = 4
"""Pictures that see a point before a pose may rest on it: with fewer it goes along."""
MAX_SHARE_TAKEN_OUT = 0.1
"""Share of the pictures: where there are few, an unsure one is better than none."""


def map_pictures(worker: Worker) -> None:
    """Poses and points by the mappers in turn, until one places enough pictures; then refined."""
    job = worker.job
    attempts: list[tuple[Attempt, Any]] = []
    for mapper in _mappers(job):
        folder = job.work / "models" / mapper.replace(" ", "-")
        folder.mkdir(parents=True, exist_ok=True)
        models = [model for model in _map(worker, mapper, folder).values() if _placed(model)]
        models.sort(key=lambda model: -len(_placed(model)))
        found = tuple(tuple(_placed(model)) for model in models)
        attempts.append((Attempt(mapper, found), models[0] if models else None))
        if found and len(found[0]) >= ENOUGH * len(job.pictures):
            break
    attempts.sort(key=lambda item: len(item[0].models[0]) if item[0].models else 0)
    kept, model = attempts[-1]
    folder = job.work / "models" / "kept"
    if model is not None:
        worker.report("mapping", 0.95, "refining poses and lens")
        if kept.mapper != KNOWN_POSES:
            _refine(model, job)
            _take_out_unsure(model, job)
            kept = replace(kept, models=(tuple(_placed(model)), *kept.models[1:]))
        folder.mkdir(exist_ok=True)
        model.write(folder)
    _keep(
        job, [*(attempt for attempt, _ in attempts[:-1]), kept], None if model is None else folder
    )


def _refine(model: Any, job: Job) -> None:
    """Adjust everything once more with a loss that wrong matches cannot pull (Cauchy)."""
    options = pycolmap.BundleAdjustmentOptions()
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = LOSS_SCALE_PX
    options.ceres.solver_options.num_threads = job.options.threads
    options.ceres.solver_options.max_num_iterations = REFINEMENT_STEPS
    pycolmap.bundle_adjustment(model, options)
    pycolmap.ObservationManager(model).filter_all_points3D(WRONG_MATCH_PX, MIN_ANGLE_DEG)
    model.update_point_3d_errors()


def _take_out_unsure(model: Any, job: Job) -> None:
    """Take out the pictures whose poses are the least sure, and adjust what remains."""
    left = int(MAX_SHARE_TAKEN_OUT * len(_placed(model)))
    while left:
        uncertain_px = {
            image.image_id: _pose_uncertainty_px(image, model) for image in model.images.values()
        }
        unsure = sorted(
            (k for k in uncertain_px if uncertain_px[k] > MAX_UNCERTAINTY_PX),
            key=lambda k: -uncertain_px[k],
        )
        if not unsure:
            return
        for image_id in unsure[:left]:
            model.deregister_frame(model.images[image_id].frame_id)
        left -= len(unsure[:left])
        _refine(model, job)


def _pose_uncertainty_px(image: Any, model: Any) -> float:
    """How far a picture's content may be off, by the points that others hold."""
    if not image.has_pose:
        return 0.0
    seen = [(p.xy, model.points3D[p.point3D_id]) for p in image.points2D if p.has_point3D()]
    held = [(xy, point.xyz) for xy, point in seen if point.track.length() >= HELD_BY]
    if not held:
        return float("inf")
    at, places = (np.array(v) for v in zip(*held, strict=True))
    in_camera = image.cam_from_world() * places
    camera = image.camera
    return pose_uncertainty_px(
        in_camera,
        np.linalg.norm(camera.img_from_cam(in_camera) - at, axis=1),
        focal_px=camera.mean_focal_length(),
        size_px=(camera.width, camera.height),
    )


def _mappers(job: Job) -> list[str]:
    if all(picture.known for picture in job.pictures):
        return [KNOWN_POSES]
    if job.options.mapper == "global":
        return ["global"]
    both = ["incremental", "incremental-forward"]
    return [*both, "global"] if job.options.mapper == "auto" else both


def _map(worker: Worker, mapper: str, folder: Path) -> dict[int, Any]:
    job = worker.job
    count = len(job.pictures)
    placed = 0

    def next_picture() -> None:
        nonlocal placed
        placed += 1
        worker.report(
            "mapping", min(0.95, placed / count), f"{mapper} mapping: picture {placed}/{count}"
        )

    worker.report("mapping", 0.0, f"{mapper} mapping")
    if mapper == KNOWN_POSES:
        return {0: _triangulate(worker, folder)}
    if mapper == "global":
        options = pycolmap.GlobalPipelineOptions()
        options.num_threads = job.options.threads
        options.random_seed = job.options.seed
        return pycolmap.global_mapping(worker.database, job.pictures_folder, folder, options)
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = job.options.threads
    options.random_seed = job.options.seed
    options.min_model_size = 3
    if mapper == "incremental-forward":
        options.mapper.init_max_forward_motion = 1.0
        options.mapper.init_min_tri_angle = 4.0
    return pycolmap.incremental_mapping(
        worker.database,
        job.pictures_folder,
        folder,
        options,
        next_image_callback=next_picture,
    )


def _triangulate(worker: Worker, folder: Path) -> Any:
    """The model of the given poses, with the points that agree with them."""
    job = worker.job
    with open_database(worker.database) as database:
        images = {p.name: database.read_image_with_name(p.name) for p in job.pictures}
        cameras = database.read_all_cameras()
    lines = [
        f"{c.camera_id} PINHOLE {c.width} {c.height} {' '.join(map(repr, c.params.tolist()))}"
        for c in cameras
    ]
    (folder / "cameras.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    lines = []
    for picture in job.pictures:
        assert picture.known is not None
        numbers = " ".join(map(repr, (*picture.known.wxyz, *picture.known.translation)))
        image = images[picture.name]
        lines.append(f"{image.image_id} {numbers} {image.camera_id} {picture.name}\n")
    (folder / "images.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "points3D.txt").write_text("", encoding="utf-8")
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = job.options.threads
    options.random_seed = job.options.seed
    return pycolmap.triangulate_points(
        pycolmap.Reconstruction(folder), worker.database, job.pictures_folder, folder, True, options
    )


def import_model(worker: Worker) -> None:
    """Take a finished model as it is."""
    job = worker.job
    assert job.import_model is not None
    worker.report("mapping", 0.0, "reading the model")
    model = pycolmap.Reconstruction(job.import_model)
    names = _placed(model, min_points=0)
    if not names:
        raise Refused(f"{job.import_model}: no picture of the model has a pose; map it again")
    left_out = _without_missing_photos(model, job.pictures_folder)
    try:
        check_left_out(job.pictures_folder, left_out, len(names))
    except CaptureError as error:
        raise Refused(str(error)) from None
    names = _placed(model, min_points=0)
    best = job.work / "models" / "import"
    best.mkdir(parents=True, exist_ok=True)
    model.write(best)
    _keep(job, [Attempt("import", (tuple(names),))], best, left_out)


def _without_missing_photos(model: Any, folder: Path) -> list[str]:
    """Take the poses of photos that are not there out of a model; say of which.

    Photos that are there under another spelling of their name are called by what they are.
    """
    left_out: list[str] = []
    taken: set[str] = set()
    for image in sorted(model.images.values(), key=lambda image: image.name):
        if not image.has_pose:
            continue
        file = find_photo(image.name, (folder,))
        name, fault = "", "there is no such photo"
        if file is not None and file.is_relative_to(folder):
            name = file.relative_to(folder).as_posix()
            if name not in taken:
                fault = _fault(file, (image.camera.width, image.camera.height))
        if fault:
            left_out.append(f"{image.name}: {fault}")
            model.deregister_frame(image.frame_id)
            continue
        taken.add(name)
        if name != image.name:
            image.name = name
    return left_out


def _fault(file: Path, wanted: tuple[int, int]) -> str:
    """Say what is wrong with a photo whose camera has a size; nothing if it fits."""
    try:
        with Image.open(file) as opened:
            size = opened.size
    except (OSError, ValueError, SyntaxError):
        return "no picture that can be read"
    if size == wanted:
        return ""
    return f"{size[0]}×{size[1]} px, its camera has {wanted[0]}×{wanted[1]}"


def _keep(
    job: Job, attempts: Sequence[Attempt], best: Path | None, left_out: Sequence[str] = ()
) -> None:
    kept = None if best is None else best.relative_to(job.work).as_posix()
    values = {
        "attempts": [asdict(attempt) for attempt in attempts],
        "kept": kept,
        "left_out": left_out,
    }
    write_json(job.work / MAPPING_FILE, values)


def _placed(model: Any, *, min_points: int = MIN_POINTS) -> list[str]:
    return sorted(
        image.name
        for image in model.images.values()
        if image.has_pose and image.num_points3D >= min_points
    )
