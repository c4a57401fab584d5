"""A training interrupted: everything it needs to go on as if nothing had happened, in one file."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.formats.storage.atomic import write_file
from scenes.prepare.train.optimiser.rows import TrainingRows
from scenes.prepare.train.trainer import Moment

NAME = "training.npz"


@dataclass(frozen=True, slots=True, eq=False)
class Checkpoint:
    """State of a training.

    Attributes:
        job: what is being trained and how, in words; another job does not go on from here.
        rows: all splats.
        iteration: steps taken.
        densified_at: how many when splats were last split.
        seconds: time spent.
        first_splats: how many it began with.
        queue: views still to come in this round, the next one last.
        random: state of the random generator.
        exposure: values, moments and steps of `Exposures`.
        history: so far.
    """

    job: str
    rows: TrainingRows
    iteration: int
    densified_at: int
    seconds: float
    first_splats: int
    queue: tuple[int, ...]
    random: dict[str, Any]
    exposure: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]
    history: tuple[Moment, ...]


def save(checkpoint: Checkpoint, folder: Path) -> None:
    """Write the checkpoint, whole or not at all.

    Raises:
        WriteError: the disk is full or the folder cannot be written; an older checkpoint stays.
    """
    rows = checkpoint.rows
    plain = {
        "job": checkpoint.job,
        "iteration": checkpoint.iteration,
        "densified_at": checkpoint.densified_at,
        "seconds": checkpoint.seconds,
        "first_splats": checkpoint.first_splats,
        "queue": checkpoint.queue,
        "random": checkpoint.random,
        "history": [asdict(moment) for moment in checkpoint.history],
    }
    values, moments, steps = checkpoint.exposure
    buffer = io.BytesIO()
    np.savez(
        buffer,
        plain=np.frombuffer(json.dumps(plain).encode(), dtype=np.uint8),
        values=rows.values,
        first=rows.first,
        second=rows.second,
        steps=rows.steps,
        error=rows.error,
        exposure_values=values,
        exposure_moments=moments,
        exposure_steps=steps,
    )
    write_file(folder / NAME, [buffer.getbuffer()])


def load(folder: Path, job: str) -> Checkpoint | None:
    """The checkpoint in `folder`; None if there is none, or if it is of another job or damaged."""
    path = folder / NAME
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as arrays:
            plain = json.loads(arrays["plain"].tobytes())
            if plain["job"] != job:
                return None
            return Checkpoint(
                job=job,
                rows=TrainingRows(
                    *(arrays[name] for name in ("values", "first", "second", "steps", "error"))
                ),
                iteration=plain["iteration"],
                densified_at=plain["densified_at"],
                seconds=plain["seconds"],
                first_splats=plain["first_splats"],
                queue=tuple(plain["queue"]),
                random=plain["random"],
                exposure=(
                    arrays["exposure_values"],
                    arrays["exposure_moments"],
                    arrays["exposure_steps"],
                ),
                history=tuple(Moment(**moment) for moment in plain["history"]),
            )
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None


def remove(folder: Path) -> None:
    """Forget the checkpoint, once the result is safe elsewhere."""
    (folder / NAME).unlink(missing_ok=True)
