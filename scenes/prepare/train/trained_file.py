"""A finished training in a folder: the splats, how good they are and how it went."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from scenes.formats.ply import WORLD_COMMENT, read_ply, write_ply
from scenes.formats.storage.atomic import write_file
from scenes.prepare.train.trainer import Moment, TrainingResult, ViewScore

SPLATS, SCORES = "splats.ply", "training.json"


def save_training(result: TrainingResult, folder: Path) -> None:
    """Write the result into a folder.

    Raises:
        WriteError: the disk is full or the folder not writable.
    """
    write_ply(folder / SPLATS, result.cloud, comments=[WORLD_COMMENT])
    values = {
        "trainer": result.trainer,
        "floating": result.floating,
        "held_out": [asdict(score) for score in result.held_out],
        "history": [asdict(moment) for moment in result.history],
    }
    write_file(folder / SCORES, [json.dumps(values, indent=1).encode()])


def load_training(folder: Path) -> TrainingResult:
    """Inverse of `save_training`.

    Raises:
        FormatError, OSError, KeyError, ValueError: a file is missing or damaged.
    """
    values = json.loads((folder / SCORES).read_text(encoding="utf-8"))
    return TrainingResult(
        read_ply(folder / SPLATS),
        tuple(ViewScore(**score) for score in values["held_out"]),
        tuple(Moment(**moment) for moment in values["history"]),
        values["trainer"],
        values.get("floating"),
    )
