"""Structure from motion: where every chosen picture was taken, and a sparse cloud of the room."""

from __future__ import annotations

import errno
import json
import shutil
from dataclasses import dataclass
from pathlib import Path

from scenes.prepare.footage.capture import Capture, CaptureError, CaptureKind
from scenes.prepare.poses.sfm.job import (
    JOB_FILE,
    LOG_FILE,
    PROGRESS_FILE,
    RESULT_FILE,
    Job,
    JobResult,
    Picture,
    SfmOptions,
    StageTime,
    job_to_json,
    result_from_json,
    write_json,
)
from scenes.prepare.poses.sfm.verdict import describe, judge_result
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, load_reconstruction
from scenes.workers.child_process import ChildProcess, module_command, module_environment

SFM_FOLDER = "sfm"
MIN_VIEWS = 3
"""Pictures that have to find their place, whatever the share."""
POLL_S = 0.1
"""Seconds between two looks at the process."""
FULL_DISK_BYTES = 20_000_000
"""Free space below which a failure is the full disk's."""
LOG_LINES = 3
"""Lines of the log in the message of a crash."""


class WorkerError(OSError):
    """The structure-from-motion process ended without a result; finished stages are kept."""


@dataclass(frozen=True, slots=True)
class SfmReport:
    """How structure from motion went.

    Attributes:
        placed: names of the pictures that found their place.
        failed: names of the others.
        models: sizes of all models that the kept mapper found, largest first.
        mapper: the one that was kept.
        points: of the sparse cloud.
        error_px: mean reprojection error.
        advice: what to film again; empty if all is well.
        times: what each stage cost in the run that finished it.
    """

    placed: tuple[str, ...]
    failed: tuple[str, ...]
    models: tuple[int, ...]
    mapper: str
    points: int
    error_px: float
    advice: tuple[str, ...]
    times: dict[str, StageTime]

    def summary(self) -> str:
        """One line for people."""
        count = len(self.placed) + len(self.failed)
        return (
            f"{len(self.placed)} of {count} pictures placed, {self.points} points, "
            f"{self.error_px:.2f} px"
        )


def reconstruct(
    capture: Capture,
    work_dir: Path,
    *,
    options: SfmOptions | None = None,
    progress: Progress = silent,
) -> tuple[Reconstruction, SfmReport]:
    """Find the pose of every picture of a capture, and take the lens's distortion out of them.

    The work happens in a process of its own, which `progress` ends by raising `Cancelled`. What is
    finished in `work_dir/sfm` is not done again as long as pictures and options stay the same.

    Returns:
        The largest connected model, in COLMAP's own frame: its scale, origin and axes mean nothing
        until it is aligned.

    Raises:
        CaptureError: too few pictures found a place; says which, and what to film again.
        WorkerError: the process crashed; says where its log is.
        OSError: the disk is full or a folder is not writable.
        Cancelled: from `progress`.
    """
    chosen = options or SfmOptions()
    work = work_dir / SFM_FOLDER
    job = Job(
        work=work,
        pictures_folder=capture.folder,
        pictures=tuple(Picture(f.name, f.lens, f.focal_px) for f in capture.frames),
        ordered=capture.kind is CaptureKind.VIDEO,
        options=chosen,
    )
    result = run_worker(job, progress)
    verdict = judge_result(capture, result)
    models = result.attempts[-1].models
    wanted = max(MIN_VIEWS, round(chosen.least_registered * len(capture.frames)))
    if len(verdict.placed) < wanted:
        others = "".join(
            f"; another group holds {describe(capture, model)}" for model in models[1:3]
        )
        raise CaptureError(
            f"{capture.source}: only {len(verdict.placed)} of {len(capture.frames)} pictures could "
            f"be placed in one room, wanted at least {wanted}; {'; '.join(verdict.advice)}{others}"
        )
    reconstruction = load_reconstruction(work / "reconstruction")
    report = SfmReport(
        placed=verdict.placed,
        failed=verdict.failed,
        models=tuple(len(model) for model in models),
        mapper=result.attempts[-1].mapper,
        points=len(reconstruction.points),
        error_px=result.error_px,
        advice=verdict.advice,
        times=result.times,
    )
    progress(1.0, report.summary())
    return reconstruction, report


def run_worker(job: Job, progress: Progress) -> JobResult:
    """Run a job in a process of its own and wait for it.

    Raises:
        CaptureError: the worker refuses the input.
        WorkerError: it crashed.
        OSError: the disk is full or a folder is not writable.
        Cancelled: from `progress`.
    """
    job.work.mkdir(parents=True, exist_ok=True)
    for old in (RESULT_FILE, PROGRESS_FILE):
        (job.work / old).unlink(missing_ok=True)
    write_json(job.work / JOB_FILE, job_to_json(job))
    with (job.work / LOG_FILE).open("wb") as log:
        process = ChildProcess(
            module_command("scenes.prepare.poses.sfm.worker", str(job.work / JOB_FILE)),
            stdout=log,
            stderr=log,
            environment=module_environment(),
        )
        try:
            _watch(process, job.work / PROGRESS_FILE, progress)
        finally:
            code = process.end()
    if code != 0 or not (job.work / RESULT_FILE).is_file():
        raise _failure(job.work, code)
    values = json.loads((job.work / RESULT_FILE).read_text(encoding="utf-8"))
    if "refused" in values:
        raise CaptureError(values["refused"])
    return result_from_json(values)


def _watch(process: ChildProcess, reports: Path, progress: Progress) -> None:
    """Pass on the worker's reports until it ends; often, so that `Cancelled` takes effect soon."""
    done, note = 0.0, "starting"
    running = True
    while running:
        running = process.wait(POLL_S) is None
        if reports.exists():
            lines = reports.read_text(encoding="utf-8").split("\n")
            if len(lines) > 1:
                values = json.loads(lines[-2])
                done, note = float(values["done"]), str(values["note"])
        progress(min(done, 1.0), note)


def _failure(work: Path, code: int) -> Exception:
    free = shutil.disk_usage(work).free
    if free < FULL_DISK_BYTES:
        return OSError(
            errno.ENOSPC,
            f"the disk is full ({free // 1_000_000} MB free): free some space and start again; "
            "finished stages are kept",
            str(work),
        )
    log = (work / LOG_FILE).read_text(encoding="utf-8", errors="replace").strip().splitlines()
    how = f"was ended by signal {-code}" if code < 0 else f"ended with code {code}"
    return WorkerError(
        f"structure from motion {how}: {' | '.join(log[-LOG_LINES:]) or 'it left no message'}; "
        f"the whole log is {work / LOG_FILE}; start again to go on after the last finished stage"
    )
