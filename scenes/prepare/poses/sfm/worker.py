"""The process that runs pycolmap: `python -m scenes.prepare.poses.sfm.worker JOB`.

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
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pycolmap

from scenes.prepare.poses.sfm.features import extract, match
from scenes.prepare.poses.sfm.job import (
    RESULT_FILE,
    StageTime,
    job_from_json,
    stage_keys,
    write_json,
)
from scenes.prepare.poses.sfm.mapping import import_model, map_pictures
from scenes.prepare.poses.sfm.outcome import outcome, undistort
from scenes.prepare.poses.sfm.session import DATABASE_FILE, Refused, Worker, open_database

STAMPS_FILE = "stages.json"


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
        "extraction": extract,
        "matching": match,
        "mapping": map_pictures,
        "undistortion": undistort,
    }
    if job.import_model is not None:
        work = {"mapping": import_model, "undistortion": undistort}
    redo = False
    for stage in work:
        stamp = stamps.get(stage, {})
        if stamp.get("key") != keys[stage]:
            _forget(worker, stage)
        elif stamp.get("finished") and not redo:
            worker.report(stage, 1.0, f"{stage} was finished before")
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
    write_json(job.work / RESULT_FILE, asdict(outcome(worker, times)))


def _forget(worker: Worker, stage: str) -> None:
    """Remove what an earlier run with other input left of a stage."""
    if stage == "extraction":
        for file in worker.job.work.glob(f"{DATABASE_FILE}*"):
            file.unlink()
    elif stage == "matching" and worker.database.exists():
        with open_database(worker.database) as database:
            database.clear_matches()
            database.clear_two_view_geometries()


def _read_stamps(work: Path) -> dict[str, Any]:
    try:
        return dict(json.loads((work / STAMPS_FILE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


def _write_stamps(work: Path, stamps: dict[str, Any]) -> None:
    write_json(work / STAMPS_FILE, stamps)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
