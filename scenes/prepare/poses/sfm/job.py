"""Job and result that structure from motion and its worker process exchange, as JSON files."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from scenes.formats.storage.atomic import write_whole

Mapper = Literal["auto", "incremental", "global"]
Matching = Literal["auto", "exhaustive", "sequential"]

JOB_FILE = "job.json"
PROGRESS_FILE = "progress.jsonl"
RESULT_FILE = "result.json"
LOG_FILE = "log.txt"
STAGES = ("extraction", "matching", "mapping", "undistortion")
STAGE_SHARES = {"extraction": 0.25, "matching": 0.4, "mapping": 0.28, "undistortion": 0.07}


@dataclass(frozen=True, slots=True)
class SfmOptions:
    """How photos find their places.

    Attributes:
        longest_px: features are found in pictures of at most this size.
        features: at most so many a picture.
        finest: look for the finest features too, at twice the size: three times slower, and two
            and a half times the points in a room with plain walls.
        matching: all pairs, or neighbours in time and pictures that look alike; "auto" takes all
            pairs up to `exhaustive_up_to` pictures.
        exhaustive_up_to: number of pictures.
        neighbours: how far along a video pictures are matched.
        similar: how many pictures that look alike are matched with each.
        mapper: incremental, global, or "auto": incremental first, then what finds more.
        lens: COLMAP camera model of the pictures.
        least_registered: share of the pictures that must find their place.
        threads: -1 for all cores.
        seed: of everything random.
    """

    longest_px: int = 1024
    features: int = 3000
    finest: bool = True
    matching: Matching = "auto"
    exhaustive_up_to: int = 60
    neighbours: int = 8
    similar: int = 8
    mapper: Mapper = "auto"
    lens: str = "SIMPLE_RADIAL"
    least_registered: float = 0.5
    threads: int = -1
    seed: int = 0

    def __post_init__(self) -> None:
        if self.matching not in ("auto", "exhaustive", "sequential"):
            raise ValueError(
                f"SfmOptions.matching: {self.matching!r}, wanted auto, exhaustive or sequential"
            )
        if self.mapper not in ("auto", "incremental", "global"):
            raise ValueError(
                f"SfmOptions.mapper: {self.mapper!r}, wanted auto, incremental or global"
            )
        if self.longest_px < 200 or self.features < 100:
            raise ValueError(
                f"SfmOptions: {self.features} features at {self.longest_px} px, "
                "wanted at least 100 at 200 px"
            )
        if not 0 < self.least_registered <= 1:
            raise ValueError(
                f"SfmOptions.least_registered: {self.least_registered}, wanted 0 < share <= 1"
            )


@dataclass(frozen=True, slots=True)
class KnownPose:
    """A pinhole camera and pose that are given, not found.

    Attributes:
        pinhole: fx, fy, cx, cy in pixels.
        wxyz: rotation of `camera_from_world`.
        translation: of `camera_from_world`.
    """

    pinhole: tuple[float, float, float, float]
    wxyz: tuple[float, ...]
    translation: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture to find a place for.

    Attributes:
        name: file name in the picture folder.
        lens: pictures with the same value share intrinsics.
        focal_px: start value, if its file has one.
        known: its camera and pose, if they are given: then only points are found.
    """

    name: str
    lens: str
    focal_px: float | None = None
    known: KnownPose | None = None


@dataclass(frozen=True, slots=True)
class Job:
    """All that the worker needs.

    Attributes:
        work: folder for the database, models and undistorted pictures.
        pictures_folder: where the pictures are; only read.
        pictures: in the order they were taken.
        ordered: whether neighbours in that order are neighbours in time.
        options: how.
        import_model: a finished COLMAP model to take poses from instead of finding them.
    """

    work: Path
    pictures_folder: Path
    pictures: tuple[Picture, ...]
    ordered: bool
    options: SfmOptions = field(default_factory=SfmOptions)
    import_model: Path | None = None


@dataclass(frozen=True, slots=True)
class StageTime:
    """Cost of a stage; zero where an earlier run had finished it."""

    wall_s: float = 0.0
    cpu_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Attempt:
    """Models that one mapper found: the pictures of each, the largest first."""

    mapper: str
    models: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class JobResult:
    """Result of the worker.

    Attributes:
        attempts: what each mapper found; the last is the one that was kept.
        features: name → number of features found.
        matches: (i, j, inliers) of every verified pair, by index into the job's pictures.
        turning_share: share of those that fit a camera that only turned, or a plane.
        error_px: mean reprojection error of the kept model.
        pose_error_px: of given poses: median distance of verified matches from where these poses
            put them; None where poses were found.
        times: per stage.
    """

    attempts: tuple[Attempt, ...]
    features: dict[str, int]
    matches: tuple[tuple[int, int, int], ...]
    turning_share: float
    error_px: float
    pose_error_px: float | None
    times: dict[str, StageTime]


def write_json(path: Path, value: object) -> None:
    """Write one JSON file at once, so that a reader never sees half of it."""
    write_whole(path, json.dumps(value, default=str))


def job_to_json(job: Job) -> dict[str, Any]:
    """Plain values."""
    return json.loads(json.dumps(asdict(job), default=str))


def job_from_json(values: dict[str, Any]) -> Job:
    """Inverse of `job_to_json`."""
    model = values["import_model"]
    return Job(
        work=Path(values["work"]),
        pictures_folder=Path(values["pictures_folder"]),
        pictures=tuple(_picture(picture) for picture in values["pictures"]),
        ordered=bool(values["ordered"]),
        options=SfmOptions(**values["options"]),
        import_model=Path(model) if model else None,
    )


def _picture(values: dict[str, Any]) -> Picture:
    known = values["known"]
    if known is None:
        return Picture(**values)
    a, b, c, d = known["pinhole"]
    pose = KnownPose((a, b, c, d), tuple(known["wxyz"]), tuple(known["translation"]))
    return Picture(values["name"], values["lens"], known=pose)


def result_from_json(values: dict[str, Any]) -> JobResult:
    """Inverse of `asdict` on a `JobResult`."""
    return JobResult(
        attempts=tuple(
            Attempt(a["mapper"], tuple(tuple(model) for model in a["models"]))
            for a in values["attempts"]
        ),
        features=dict(values["features"]),
        matches=tuple((int(i), int(j), int(n)) for i, j, n in values["matches"]),
        turning_share=float(values["turning_share"]),
        error_px=float(values["error_px"]),
        pose_error_px=values["pose_error_px"],
        times={stage: StageTime(**time) for stage, time in values["times"].items()},
    )


def _stamp(file: Path) -> tuple[int, int]:
    status = file.stat()
    return status.st_size, status.st_mtime_ns


def stage_keys(job: Job) -> dict[str, str]:
    """For each stage a value that changes with whatever its result depends on."""
    o = job.options
    stamps = [
        (asdict(picture), *_stamp(job.pictures_folder / picture.name)) for picture in job.pictures
    ]
    if job.import_model is not None:
        files = sorted(job.import_model.iterdir())
        stamps = [({"name": file.name}, *_stamp(file)) for file in files]
    inputs: dict[str, object] = {
        "extraction": (stamps, o.longest_px, o.features, o.finest, o.lens),
        "matching": (o.matching, o.exhaustive_up_to, o.neighbours, o.similar, o.seed, job.ordered),
        "mapping": (o.mapper, o.seed, str(job.import_model)),
        "undistortion": (),
    }
    keys: dict[str, str] = {}
    before = ""
    for stage in STAGES:
        text = json.dumps([before, inputs[stage]])
        before = keys[stage] = hashlib.sha256(text.encode()).hexdigest()
    return keys
