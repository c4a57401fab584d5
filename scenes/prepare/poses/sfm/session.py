# pyright: standard
"""State shared by the parts of the structure-from-motion process: job, database, progress."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pycolmap

from scenes.prepare.poses.sfm.job import PROGRESS_FILE, STAGE_SHARES, STAGES, Job

DATABASE_FILE = "database.db"
MAPPING_FILE = "mapping.json"

# COLMAP would write a log file a process and level into the system's temporary folder.
for _level in ("INFO", "WARNING", "ERROR", "FATAL"):
    pycolmap.logging.set_log_destination(getattr(pycolmap.logging, _level), "")

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

    def report(self, stage: str, done: float, note: str) -> None:
        """Append a line of progress; end if nobody reads it any more."""
        if os.getppid() != self.parent:
            raise SystemExit(1)
        before = sum(STAGE_SHARES[s] for s in STAGES[: STAGES.index(stage)])
        line = {"done": before + STAGE_SHARES[stage] * done, "stage": stage, "note": note}
        with (self.job.work / PROGRESS_FILE).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


@contextmanager
def open_database(path: Path) -> Iterator[Any]:
    """COLMAP's database, closed whatever happens."""
    database = pycolmap.Database.open(path)
    try:
        yield database
    finally:
        database.close()
