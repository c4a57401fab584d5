"""The process that runs pycolmap: `python -m scenes.prepare.poses.sfm_worker JOB`.

pycolmap may end its whole process on an error, so it never runs in the studio's own. Only SIFT is
ever asked for: the wheel has no runtime for learned features and aborts on them. Each stage leaves
a stamp; a killed worker that is started again goes on after the last finished stage, extraction and
matching also within.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.poses.epipolar import epipolar_distances_px
from scenes.prepare.poses.pairs import (
    Pair,
    all_pairs,
    neighbour_pairs,
    picture_signatures,
    similar_pairs,
)
from scenes.prepare.poses.sfm_job import (
    PROGRESS_FILE,
    RESULT_FILE,
    STAGE_SHARES,
    STAGES,
    Attempt,
    Job,
    JobResult,
    KnownPose,
    StageTime,
    job_from_json,
    stage_keys,
    write_json,
)
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.saved_reconstruction import save_reconstruction

STAMPS_FILE = "stages.json"
DATABASE_FILE = "database.db"
MAPPING_FILE = "mapping.json"
PICTURES_AT_ONCE = 8
PAIRS_AT_ONCE = 60
FOCAL_OVER_LONGEST = 0.85
"""Of a phone's main camera, for pictures that do not tell theirs."""
ENOUGH = 0.9
"""Share of placed pictures at which no other mapper is tried."""
LEAST_POINTS = 20
"""A picture that sees fewer points has no place that can be relied on."""
JPEG_QUALITY = 97
KNOWN_POSES = "known poses"
LOSS_SCALE_PX = 0.5
REFINEMENT_STEPS = 60
WRONG_MATCH_PX = 2.0
LEAST_ANGLE_DEG = 1.5

FloatArray = NDArray[np.float64]
Stopwatch = Callable[[], tuple[float, float]]
"""Wall and CPU seconds since some moment."""


class Refused(Exception):
    """The input makes no sense; the message goes to its user."""


@dataclass(slots=True)
class Worker:
    """One job while it runs."""

    job: Job
    stopwatch: Stopwatch
    parent: int

    @property
    def database(self) -> Path:
        """Features and matches; COLMAP's own file."""
        return self.job.work / DATABASE_FILE

    def tell(self, stage: str, done: float, note: str) -> None:
        """Append a line of progress; end if nobody reads it any more."""
        if os.getppid() != self.parent:
            raise SystemExit(1)
        before = sum(STAGE_SHARES[s] for s in STAGES[: STAGES.index(stage)])
        line = {"done": before + STAGE_SHARES[stage] * done, "stage": stage, "note": note}
        with (self.job.work / PROGRESS_FILE).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


def main(job_file: str) -> int:
    """Run one job file to its end."""
    job = job_from_json(json.loads(Path(job_file).read_text(encoding="utf-8")))
    worker = Worker(job, lambda: (time.perf_counter(), time.process_time()), os.getppid())
    pycolmap.set_random_seed(job.options.seed)
    try:
        run(worker)
    except Refused as reason:
        write_json(job.work / RESULT_FILE, {"refused": str(reason)})
    return 0


def run(worker: Worker) -> None:
    """All stages that are not finished yet, then the result."""
    job = worker.job
    keys = stage_keys(job)
    stamps = _read_stamps(job.work)
    work: dict[str, Callable[[Worker], None]] = {
        "extraction": _extract,
        "matching": _match,
        "mapping": _map,
        "undistortion": _undistort,
    }
    if job.import_model is not None:
        work = {"mapping": _import, "undistortion": _undistort}
    redo = False
    for stage in work:
        stamp = stamps.get(stage, {})
        if stamp.get("key") != keys[stage]:
            _forget(worker, stage)
        elif stamp.get("finished") and not redo:
            worker.tell(stage, 1.0, f"{stage} was finished before")
            continue
        redo = True
        stamps[stage] = {"key": keys[stage], "finished": False}
        _write_stamps(job.work, stamps)
        wall, cpu = worker.stopwatch()
        work[stage](worker)
        wall_now, cpu_now = worker.stopwatch()
        stamps[stage] = {
            "key": keys[stage],
            "finished": True,
            "time": asdict(StageTime(wall_now - wall, cpu_now - cpu)),
        }
        _write_stamps(job.work, stamps)
    times = {stage: StageTime(**stamps[stage]["time"]) for stage in work}
    write_json(job.work / RESULT_FILE, asdict(_result(worker, times)))


def _forget(worker: Worker, stage: str) -> None:
    """Remove what an earlier run with other input left of a stage."""
    if stage == "extraction":
        for file in worker.job.work.glob(f"{DATABASE_FILE}*"):
            file.unlink()
    elif stage == "matching" and worker.database.exists():
        with _open(worker.database) as database:
            database.clear_matches()
            database.clear_two_view_geometries()


def _extract(worker: Worker) -> None:
    """SIFT features of every picture; pictures of one lens share a camera."""
    job, o = worker.job, worker.job.options
    options = pycolmap.FeatureExtractionOptions()
    options.type = pycolmap.FeatureExtractorType.SIFT
    options.num_threads = o.threads
    options.max_image_size = o.longest_px
    options.sift.max_num_features = o.features
    options.sift.first_octave = -1 if o.finest else 0
    lenses = list(dict.fromkeys(picture.lens for picture in job.pictures))
    count = 0
    for lens in lenses:
        pictures = [picture for picture in job.pictures if picture.lens == lens]
        focals = [p.focal_px for p in pictures if p.focal_px]
        for start in range(0, len(pictures), PICTURES_AT_ONCE):
            names = [p.name for p in pictures[start : start + PICTURES_AT_ONCE]]
            reader = pycolmap.ImageReaderOptions()
            given = pictures[0].known
            reader.camera_model = "PINHOLE" if given else o.lens
            reader.default_focal_length_factor = FOCAL_OVER_LONGEST
            known = _camera_of(worker, pictures)
            if known is not None:
                reader.existing_camera_id = known
            elif given:
                reader.camera_params = ",".join(repr(value) for value in given.pinhole)
            elif focals:
                path = job.pictures_folder / pictures[0].name
                reader.camera_params = _start_values(
                    reader.camera_model, path, float(np.median(focals))
                )
            pycolmap.extract_features(
                worker.database,
                job.pictures_folder,
                names,
                pycolmap.CameraMode.SINGLE,
                reader,
                options,
                pycolmap.Device.cpu,
            )
            count += len(names)
            worker.tell(
                "extraction", count / len(job.pictures), f"features: {count}/{len(job.pictures)}"
            )


def _start_values(model: str, path: Path, focal_px: float) -> str:
    camera = pycolmap.Camera.create(
        0, getattr(pycolmap.CameraModelId, model), focal_px, *_size(path)
    )
    return camera.params_to_string()


def _size(path: Path) -> tuple[int, int]:
    bitmap = pycolmap.Bitmap.read(path, as_rgb=False)
    if bitmap is None:
        raise Refused(f"{path}: no picture that can be read; gather the pictures again")
    return bitmap.width, bitmap.height


def _camera_of(worker: Worker, pictures: Sequence[Any]) -> int | None:
    """The camera that an already extracted picture of the same lens has."""
    if not worker.database.exists():
        return None
    with _open(worker.database) as database:
        for picture in pictures:
            image = database.read_image_with_name(picture.name)
            if image is not None:
                return int(image.camera_id)
    return None


def _match(worker: Worker) -> None:
    """SIFT matches and two-view geometry of the chosen pairs; pairs done before are skipped."""
    job = worker.job
    names = [picture.name for picture in job.pictures]
    worker.tell("matching", 0.0, "which pictures look alike")
    pairs = _chosen_pairs(worker)
    options = pycolmap.FeatureMatchingOptions()
    options.type = pycolmap.FeatureMatcherType.SIFT_BRUTEFORCE
    options.num_threads = job.options.threads
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = job.options.seed
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = job.work / "pairs.txt"
    for start in range(0, len(pairs), PAIRS_AT_ONCE):
        block = pairs[start : start + PAIRS_AT_ONCE]
        lines = [f"{names[i]} {names[j]}" for i, j in block]
        (job.work / "pairs.txt").write_text("\n".join(lines), encoding="utf-8")
        pycolmap.match_image_pairs(
            worker.database, options, pairing, verification, pycolmap.Device.cpu
        )
        done = min(len(pairs), start + PAIRS_AT_ONCE)
        worker.tell("matching", done / len(pairs), f"matching: {done}/{len(pairs)} pairs")


def _chosen_pairs(worker: Worker) -> list[Pair]:
    job, o = worker.job, worker.job.options
    count = len(job.pictures)
    few = count <= o.exhaustive_up_to
    if o.matching == "exhaustive" or (o.matching == "auto" and few):
        pairs = all_pairs(count)
    else:
        near = neighbour_pairs(count, o.neighbours) if job.ordered else []
        each = o.similar if job.ordered else o.similar + o.neighbours
        with _open(worker.database) as database:
            ids = [database.read_image_with_name(p.name).image_id for p in job.pictures]
            descriptors = [np.asarray(database.read_descriptors(i).data) for i in ids]
        signatures = picture_signatures(descriptors, np.random.default_rng(o.seed))
        apart = o.neighbours + 1 if job.ordered else 1
        far = similar_pairs(signatures, each, apart=apart)
        pairs = list(dict.fromkeys([*near, *far]))
    return sorted(pairs, key=lambda pair: (pair[0] // PICTURES_AT_ONCE, pair[1]))


def _map(worker: Worker) -> None:
    """Poses and points by the mappers in turn, until one places enough pictures; then refined."""
    job = worker.job
    attempts: list[tuple[Attempt, Any]] = []
    for mapper in _mappers(job):
        folder = job.work / "models" / mapper.replace(" ", "-")
        folder.mkdir(parents=True, exist_ok=True)
        models = [model for model in _mapped(worker, mapper, folder).values() if _placed(model)]
        models.sort(key=lambda model: -len(_placed(model)))
        found = tuple(tuple(_placed(model)) for model in models)
        attempts.append((Attempt(mapper, found), models[0] if models else None))
        if found and len(found[0]) >= ENOUGH * len(job.pictures):
            break
    attempts.sort(key=lambda item: len(item[0].models[0]) if item[0].models else 0)
    kept, model = attempts[-1]
    folder = job.work / "models" / "kept"
    if model is not None:
        worker.tell("mapping", 0.95, "refining poses and lens")
        if kept.mapper != KNOWN_POSES:
            _refine(model, job)
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
    pycolmap.ObservationManager(model).filter_all_points3D(WRONG_MATCH_PX, LEAST_ANGLE_DEG)
    model.update_point_3d_errors()


def _mappers(job: Job) -> list[str]:
    if all(picture.known for picture in job.pictures):
        return [KNOWN_POSES]
    if job.options.mapper == "global":
        return ["global"]
    both = ["incremental", "incremental-forward"]
    return [*both, "global"] if job.options.mapper == "auto" else both


def _mapped(worker: Worker, mapper: str, folder: Path) -> dict[int, Any]:
    job = worker.job
    count = len(job.pictures)
    placed = 0

    def next_picture() -> None:
        nonlocal placed
        placed += 1
        worker.tell(
            "mapping", min(0.95, placed / count), f"{mapper} mapping: picture {placed}/{count}"
        )

    worker.tell("mapping", 0.0, f"{mapper} mapping")
    if mapper == KNOWN_POSES:
        return {0: _triangulated(worker, folder)}
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


def _triangulated(worker: Worker, folder: Path) -> Any:
    """The model of the given poses, with the points that agree with them."""
    job = worker.job
    with _open(worker.database) as database:
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


def _import(worker: Worker) -> None:
    """Take a finished model as it is."""
    job = worker.job
    assert job.import_model is not None
    worker.tell("mapping", 0.0, "reading the model")
    model = pycolmap.Reconstruction(job.import_model)
    names = _placed(model, least_points=0)
    if not names:
        raise Refused(f"{job.import_model}: no picture of the model has a pose; map it again")
    missing = [name for name in names if not (job.pictures_folder / name).is_file()]
    if missing:
        raise Refused(
            f"{job.pictures_folder}: {len(missing)} of {len(names)} photos of the model are "
            f"missing, such as {missing[0]}; give the folder that the model was made from"
        )
    best = job.work / "models" / "import"
    best.mkdir(parents=True, exist_ok=True)
    model.write(best)
    _keep(job, [Attempt("import", (tuple(names),))], best)


def _keep(job: Job, attempts: Sequence[Attempt], best: Path | None) -> None:
    kept = None if best is None else best.relative_to(job.work).as_posix()
    values = {"attempts": [asdict(attempt) for attempt in attempts], "kept": kept}
    write_json(job.work / MAPPING_FILE, values)


def _placed(model: Any, *, least_points: int = LEAST_POINTS) -> list[str]:
    return sorted(
        image.name
        for image in model.images.values()
        if image.has_pose and image.num_points3D >= least_points
    )


def _undistort(worker: Worker) -> None:
    """Pinhole pictures of the kept model, and everything as a `Reconstruction`."""
    job = worker.job
    mapping = json.loads((job.work / MAPPING_FILE).read_text(encoding="utf-8"))
    if mapping["kept"] is None:
        return
    worker.tell("undistortion", 0.0, "taking the lens's distortion out of the pictures")
    out = job.work / "undistorted"
    placed = list(mapping["attempts"][-1]["models"][0])
    pycolmap.undistort_images(
        out,
        job.work / mapping["kept"],
        job.pictures_folder,
        placed,
        jpeg_quality=JPEG_QUALITY,
        num_threads=job.options.threads,
    )
    order = {picture.name: i for i, picture in enumerate(job.pictures)}
    placed.sort(key=lambda name: (order.get(name, 0), name))
    flat = _reconstruction(pycolmap.Reconstruction(out / "sparse"), out / "images", placed)
    save_reconstruction(flat, job.work / "reconstruction")
    worker.tell("undistortion", 1.0, f"{len(placed)} pictures placed")


def _reconstruction(model: Any, pictures: Path, placed: Sequence[str]) -> Reconstruction:
    by_name = {image.name: image for image in model.images.values()}
    views = []
    for name in placed:
        image = by_name[name]
        camera_from_world = Pose.from_matrix(
            np.vstack([image.cam_from_world().matrix(), [0, 0, 0, 1]])
        )
        camera = _pinhole(model.cameras[image.camera_id])
        views.append(View(name, pictures / name, camera, camera_from_world.inverse()))
    points = list(model.points3D.values())
    return Reconstruction(
        tuple(views),
        np.array([p.xyz for p in points], dtype=np.float64).reshape(-1, 3),
        np.array([p.color for p in points], dtype=np.uint8).reshape(-1, 3),
        np.array([p.error for p in points], dtype=np.float32),
    )


def _pinhole(camera: Any) -> Pinhole:
    return Pinhole(
        int(camera.width),
        int(camera.height),
        float(camera.focal_length_x),
        float(camera.focal_length_y),
        float(camera.principal_point_x),
        float(camera.principal_point_y),
    )


def _result(worker: Worker, times: dict[str, StageTime]) -> JobResult:
    job = worker.job
    mapping = json.loads((job.work / MAPPING_FILE).read_text(encoding="utf-8"))
    attempts = tuple(
        Attempt(a["mapper"], tuple(tuple(m) for m in a["models"])) for a in mapping["attempts"]
    )
    error_px = float("nan")
    if mapping["kept"] is not None:
        model = pycolmap.Reconstruction(job.work / mapping["kept"])
        error_px = float(model.compute_mean_reprojection_error())
    features: dict[str, int] = {}
    matches: list[tuple[int, int, int]] = []
    turning = 0
    pose_errors: list[float] = []
    if worker.database.exists():
        with _open(worker.database) as database:
            numbers: dict[int, int] = {}
            for number, picture in enumerate(job.pictures):
                image = database.read_image_with_name(picture.name)
                if image is not None:
                    numbers[int(image.image_id)] = number
                    features[picture.name] = int(database.num_keypoints_for_image(image.image_id))
            for pair_id, geometry in zip(*database.read_two_view_geometries(), strict=True):
                pairs = np.asarray(geometry.inlier_matches)
                if not len(pairs):
                    continue
                ids = pycolmap.pair_id_to_image_pair(pair_id)
                i, j = (numbers[k] for k in ids)
                matches.append((i, j, len(pairs)))
                turning += "PANORAMIC" in str(geometry.config)
                known = job.pictures[i].known, job.pictures[j].known
                if known[0] is not None and known[1] is not None:
                    at = [
                        np.asarray(database.read_keypoints(k).data)[pairs[:, n], :2]
                        for n, k in enumerate(ids)
                    ]
                    pose_errors.extend(_pose_errors_px((known[0], known[1]), (at[0], at[1])))
    return JobResult(
        attempts,
        features,
        tuple(sorted(matches)),
        turning / len(matches) if matches else 0.0,
        error_px,
        float(np.median(pose_errors)) if pose_errors else None,
        times,
    )


def _pose_errors_px(
    known: tuple[KnownPose, KnownPose], at: tuple[FloatArray, FloatArray]
) -> FloatArray:
    first_from_world, second_from_world = (
        Pose.from_quaternion(k.wxyz, k.translation) for k in known
    )
    first, second = (Pinhole(1, 1, *k.pinhole) for k in known)
    second_from_first = second_from_world @ first_from_world.inverse()
    return epipolar_distances_px(*at, (first, second), second_from_first)


def _read_stamps(work: Path) -> dict[str, Any]:
    try:
        return dict(json.loads((work / STAMPS_FILE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


def _write_stamps(work: Path, stamps: dict[str, Any]) -> None:
    write_json(work / STAMPS_FILE, stamps)


@contextmanager
def _open(path: Path) -> Iterator[Any]:
    database = pycolmap.Database.open(path)
    try:
        yield database
    finally:
        database.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
