"""A second reconstruction of a prepared room, to stand for the real one in rehearsals.

It is trained from another random start and on the photos that the scan kept aside as well, so its
splats are others. Photos, their poses and the
metric world are the scan's: what is wrong with those is wrong with both, and a rehearsal does not
see it. How optimistic that makes it is measured in docs/twin.md.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.package import ScenePackage
from scenes.package.reality import Reality
from scenes.prepare.align.saved_alignment import load_alignment
from scenes.prepare.pipeline import TRAINING
from scenes.prepare.progress import Progress
from scenes.prepare.room_photos import photos_of
from scenes.prepare.stages import open_work_folder
from scenes.prepare.train import checkpoint
from scenes.prepare.train.train import BUILT_IN_VERSION, BuiltInTrainer
from scenes.prepare.train.trained_file import load_training
from scenes.prepare.train.trainer import PRESETS

QUALITY = "default"
"""Preset of the second training. Of three in room C (default and fine on all photos, default on
every second one) it predicts the measured errors best: docs/twin.md has the figures."""
STREAM = 1
"""Child of the seed that it draws from; the scan draws from the seed itself."""
SPLATS = "splats.ply"


def with_reality(
    package: ScenePackage,
    work_folder: Path,
    *,
    seed: int,
    seconds: Callable[[], float],
    progress: Progress,
) -> ScenePackage:
    """The package with a second reconstruction of its room.

    Args:
        package: a prepared room, with or without objects cut out.
        work_folder: of its preparation; keeps the second training, too.
        seed: decides everything random.
        seconds: a stopwatch.
        progress: called with the share done.

    Raises:
        ValueError: the folder holds no preparation of this room.
        OSError, Cancelled: the training stopped; it goes on from there when called again.
    """
    metric = photos_of(
        package, work_folder, wanted="rehearse in it, prepare it again with --rehearsable"
    )
    scan = load_training(work_folder / TRAINING)
    alignment = load_alignment(work_folder / "alignment")
    work = open_work_folder(work_folder, seconds=seconds, progress=progress)
    options = replace(PRESETS[QUALITY], held_out_every=0)

    def make(folder: Path, progress: Progress) -> Path:
        trainer = BuiltInTrainer(
            options, rng=lambda: np.random.default_rng([seed, STREAM]), stopwatch=seconds
        )
        result = trainer.train(metric, folder, progress=progress)
        write_ply(folder / SPLATS, result.cloud, comments=[WORLD_COMMENT])
        checkpoint.remove(folder)
        return folder / SPLATS

    points_stage = json.loads((work_folder / "outdoor points" / "stage.json").read_text())
    splats = work.run(
        "reality",
        {"trainer": BUILT_IN_VERSION, "seed": seed, "quality": QUALITY, "of": points_stage["key"]},
        make=make,
        load=lambda folder, progress: folder / SPLATS,
        detail=lambda path: f"second reconstruction, {QUALITY}",
    )
    codes_m = alignment.references_m
    reality = Reality(
        splats=splats,
        trainer=f"{BUILT_IN_VERSION}, {QUALITY}",
        photos=len(metric.views),
        shared=len(metric.views) - len(scan.held_out),
        covariance=alignment.covariance,
        bend_per_metre=alignment.bend_per_metre,
        centre_m=codes_m.mean(axis=0) if len(codes_m) else np.zeros(3),
    )
    return replace(package, reality=reality, stages=(*package.stages, work.log[-1]))
