"""How work in the window came to its end: what is said of it, and what there is to look at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from studio.app.model.jobs.scene_job import SceneJob
from studio.app.model.log import Level
from studio.console.rows import exit_code
from studio.session.records.outputs import RECORDING


@dataclass(frozen=True, slots=True)
class Ending:
    """How it ended.

    Attributes:
        line: what is said, in words.
        level: how bad it is; None if nobody needs to know.
        shown: the recording that is opened now; None if there is none.
        kept: of a session that was stopped: its recording, which is not opened by itself.
        is_failure: whether it came to nothing that was wanted.
    """

    line: str
    level: Level | None = None
    shown: Path | None = None
    kept: Path | None = None
    is_failure: bool = False


def ending_of(job: SceneJob) -> Ending:
    """How a job that no longer runs has ended."""
    from studio.session.pipeline import CancelledError

    performance = job.performance
    if isinstance(job.failure, CancelledError):
        return Ending("stopped before anything was recorded", "info")
    if job.failure is not None:
        words = " ".join(str(job.failure).split()) or type(job.failure).__name__
        return Ending(words, "error", is_failure=True)
    if performance is not None and performance.cut_short:
        text = f"{performance.cut_short}; what was recorded is kept as {performance.folder.name}"
        return Ending(text, "info", kept=performance.folder / RECORDING)
    if performance is not None:
        missed = exit_code(performance.rows)
        verdict = "✗ a figure misses its bar" if missed else "✓ every figure meets its bar"
        text = f"{verdict}; the report is in {performance.folder}"
        return Ending(text, "warning" if missed else "info", performance.folder / RECORDING)
    if job.last_words:
        return Ending(job.last_words, "info", job.recording)
    return Ending("the replay has ended" if job.plays else "ready", shown=job.recording)
