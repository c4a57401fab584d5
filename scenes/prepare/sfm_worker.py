"""The process that runs pycolmap: `python -m scenes.prepare.sfm_worker JOB`.

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
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.pairs import (
    Pair,
    all_pairs,
    neighbour_pairs,
    picture_signatures,
    similar_pairs,
)
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.saved_reconstruction import save_reconstruction
from scenes.prepare.sfm_job import (
    PROGRESS_FILE,
    RESULT_FILE,
    STAGE_SHARES,
    STAGES,
    Attempt,
    Job,
    JobResult,
    StageTime,
    job_from_json,
    stage_keys,
    write_json,
)

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

Stopwatch = Callable[[], tuple[float, float]]
"""Wall and CPU seconds since some moment."""


@dataclass(slots=True)
class Worker:
    """One job while it runs."""

    job: Job
    stopwatch: Stopwatch
    parent: int

    @property
    def database(self) -> Path:
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
    run(worker)
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
    redo = False
    for stage in STAGES:
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
    times = {stage: StageTime(**stamps[stage]["time"]) for stage in STAGES}
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
            reader.camera_model = _lens_model(job, len(pictures))
            reader.default_focal_length_factor = FOCAL_OVER_LONGEST
            known = _camera_of(worker, pictures)
            if known is not None:
                reader.existing_camera_id = known
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


def _lens_model(job: Job, pictures: int) -> str:
    if job.options.lens != "auto":
        return job.options.lens
    return "RADIAL" if job.ordered or pictures >= 20 else "SIMPLE_RADIAL"


def _start_values(model: str, path: Path, focal_px: float) -> str:
    camera = pycolmap.Camera.create(
        0, getattr(pycolmap.CameraModelId, model), focal_px, *_size(path)
    )
    return camera.params_to_string()


def _size(path: Path) -> tuple[int, int]:
    bitmap = pycolmap.Bitmap.read(path, as_rgb=False)
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
    """Poses and points by the mappers in turn, until one places enough pictures."""
    job = worker.job
    attempts: list[tuple[Attempt, Path]] = []
    for mapper in _mappers(job):
        folder = job.work / "models" / mapper
        folder.mkdir(parents=True, exist_ok=True)
        models = _mapped(worker, mapper, folder)
        ranked = sorted(models.items(), key=lambda item: -len(_placed(item[1])))
        names = tuple(tuple(sorted(_placed(model))) for _, model in ranked)
        best = folder / "best"
        best.mkdir(exist_ok=True)
        if ranked:
            ranked[0][1].write(best)
        attempts.append((Attempt(mapper, tuple(n for n in names if n)), best))
        if names and len(names[0]) >= ENOUGH * len(job.pictures):
            break
    attempts.sort(key=lambda item: len(item[0].models[0]) if item[0].models else 0)
    write_json(
        job.work / MAPPING_FILE,
        {
            "attempts": [asdict(attempt) for attempt, _ in attempts],
            "kept": str(attempts[-1][1].relative_to(job.work)) if attempts[-1][0].models else None,
        },
    )


def _mappers(job: Job) -> list[str]:
    if job.import_model is not None:
        return ["import"]
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

    if mapper == "import":
        return {0: pycolmap.Reconstruction(job.import_model)}
    worker.tell("mapping", 0.0, f"{mapper} mapping")
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


def _placed(model: Any) -> list[str]:
    return [
        image.name
        for image in model.images.values()
        if image.has_pose and image.num_points3D >= LEAST_POINTS
    ]


def _undistort(worker: Worker) -> None:
    """Pinhole pictures of the kept model, and everything as a `Reconstruction`."""
    job = worker.job
    kept = json.loads((job.work / MAPPING_FILE).read_text(encoding="utf-8"))["kept"]
    if kept is None:
        return
    worker.tell("undistortion", 0.0, "taking the lens's distortion out of the pictures")
    out = job.work / "undistorted"
    model = pycolmap.Reconstruction(job.work / kept)
    placed = set(_placed(model))
    pycolmap.undistort_images(
        out,
        job.work / kept,
        job.pictures_folder,
        sorted(placed),
        jpeg_quality=JPEG_QUALITY,
        num_threads=job.options.threads,
    )
    flat = pycolmap.Reconstruction(out / "sparse")
    save_reconstruction(_reconstruction(job, flat, out / "images", placed), job.work / "reconstruction")
    worker.tell("undistortion", 1.0, f"{len(placed)} pictures placed")


def _reconstruction(job: Job, model: Any, pictures: Path, placed: set[str]) -> Reconstruction:
    by_name = {image.name: image for image in model.images.values()}
    views = []
    for picture in job.pictures:
        image = by_name.get(picture.name)
        if image is None or picture.name not in placed:
            continue
        camera_from_world = Pose.from_matrix(
            np.vstack([image.cam_from_world().matrix(), [0, 0, 0, 1]])
        )
        views.append(
            View(
                picture.name,
                pictures / picture.name,
                _pinhole(model.cameras[image.camera_id]),
                camera_from_world.inverse(),
            )
        )
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
    if worker.database.exists():
        with _open(worker.database) as database:
            ids = {}
            for number, picture in enumerate(job.pictures):
                image = database.read_image_with_name(picture.name)
                if image is not None:
                    ids[int(image.image_id)] = number
                    features[picture.name] = int(
                        database.num_keypoints_for_image(image.image_id)
                    )
            for pair_id, geometry in zip(*database.read_two_view_geometries(), strict=True):
                inliers = len(geometry.inlier_matches)
                if not inliers:
                    continue
                a, b = pycolmap.pair_id_to_image_pair(pair_id)
                matches.append((ids[a], ids[b], inliers))
                turning += "PANORAMIC" in str(geometry.config)
    return JobResult(
        attempts,
        features,
        tuple(sorted(matches)),
        turning / len(matches) if matches else 0.0,
        error_px,
        times,
    )


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
