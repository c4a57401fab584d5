"""The room's splats, however they come: trained here, by another program, or trained already."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from scenes.formats.registry import read_splats
from scenes.prepare.align.alignment import Alignment, apply_alignment
from scenes.prepare.options import BUILT_IN, PrepareOptions
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train.external_trainers import (
    ITERATIONS,
    ExternalProgram,
    ExternalTrainer,
    brush,
    gsplat,
    inria,
    opensplat,
)
from scenes.prepare.train.held_out import score_photo
from scenes.prepare.train.train import BuiltInTrainer
from scenes.prepare.train.trained_import import check_trained
from scenes.prepare.train.trainer import (
    PRESETS,
    Moment,
    Preview,
    Stopwatch,
    Trainer,
    TrainingResult,
)
from scenes.prepare.train.training_photos import Photos
from scenes.render.native import NativeRenderer
from scenes.render.renderer import RenderOptions
from scenes.render.training import Exposure
from scenes.splats import SplatCloud

PREVIEWS = "previews"


def trainer_of(options: PrepareOptions, stopwatch: Stopwatch) -> Trainer:
    """Return the built-in trainer, or the program that was asked for."""
    preset, program = PRESETS[options.quality], options.program
    if options.steps is not None:
        preset = replace(preset, iterations=options.steps)
    if options.trainer == BUILT_IN:
        return BuiltInTrainer(
            preset, rng=lambda: np.random.default_rng(options.seed), stopwatch=stopwatch
        )
    # The quality's own steps are this trainer's; others have a length of their own.
    preset = replace(preset, iterations=options.steps or ITERATIONS)
    return ExternalTrainer(_program(options.trainer, program), preset, stopwatch=stopwatch)


def _program(name: str, path: Path | None) -> ExternalProgram:
    by_name: dict[str, Callable[[str], ExternalProgram]] = {"brush": brush, "opensplat": opensplat}
    if name in by_name:
        return by_name[name](str(path or name))
    assert path is not None
    return gsplat(path) if name == "gsplat" else inria(path)


def train_room(
    metric: Reconstruction, folder: Path, *, trainer: Trainer, progress: Progress
) -> TrainingResult:
    """Train, and keep a picture of it now and then as `previews/0000.jpg` to `1000.jpg`.

    Raises:
        ValueError, OSError, Cancelled: as the trainer.
    """
    previews = folder / PREVIEWS
    previews.mkdir(exist_ok=True)

    def show(preview: Preview) -> None:
        both = np.hstack([preview.photo, preview.picture])
        Image.fromarray(both).save(previews / f"{round(1000 * preview.done):04d}.jpg")

    return trainer.train(metric, folder, progress=progress, show=show)


def import_splats(
    file: Path,
    reconstruction: Reconstruction,
    alignment: Alignment,
    *,
    options: PrepareOptions,
    renderer: NativeRenderer,
    progress: Progress,
) -> TrainingResult:
    """Splats that were trained already, in the frame of the given poses or in the metric world.

    Args:
        file: any splat file.
        reconstruction: the photos with the given poses, as they came.
        alignment: leads from there to the metric world.
        options: its quality says at which size pictures are judged.
        renderer: draws.
        progress: called with the share done.

    Raises:
        FormatError: the file cannot be read.
        ValueError: values are damaged, or the splats do not draw the photos in either frame.
    """
    progress(0.0, f"reading {file.name}")
    left_out: list[str] = []
    cloud = read_splats(file, on_bad=left_out.append)
    metric = apply_alignment(reconstruction, alignment)
    progress(0.3, "drawing photos with it")
    try:
        check_trained(cloud, reconstruction, renderer, where=str(file))
        room = alignment.world_from_reconstruction.moved_cloud(cloud)
    except ValueError:
        if not _draws(cloud, metric, renderer, file):
            raise
        room = cloud
    preset = PRESETS[options.quality]
    photos = Photos(metric, held_out_every=preset.held_out_every, longest_px=preset.longest_px)
    drawing = RenderOptions(background=preset.background)
    progress(0.7, "judging it")
    scores = tuple(
        score_photo(renderer, room, photos.photo(view), drawing, lens=Exposure())
        for view in photos.held_out
    )
    history = (Moment(0, 0.0, len(room), float("nan"), None),)
    whose = "; ".join([file.name, *left_out])
    return TrainingResult(room, scores, history, f"someone else ({whose})")


def _draws(cloud: SplatCloud, metric: Reconstruction, renderer: NativeRenderer, file: Path) -> bool:
    try:
        check_trained(cloud, metric, renderer, where=str(file))
    except ValueError:
        return False
    return True
