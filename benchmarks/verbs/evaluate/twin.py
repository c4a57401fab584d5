"""`nexus evaluate twin FOLDER`: whether errors rehearsed in a scan are those of the real room."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # what a measurement takes is imported when one begins
    from benchmarks.evaluate.dataset.layout import Dataset
    from benchmarks.evaluate.dataset.preparing import PreparedDataset
    from benchmarks.evaluate.dataset.tracking import Pictures, Tracked
    from scenes.package import ScenePackage
    from scenes.prepare.cutout.likewise import TakenApart
    from scenes.render.native import NativeRenderer
    from studio.console.progress import Progress

DRAWS = 3
"""Draws of how far the real room is from the scan's world: one alone may be near to nothing."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("folder", type=Path, help="photos, 360° pictures and truth of a room")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="keep the package and its stages here"
    )
    parser.add_argument(
        "--quality", choices=("preview", "default", "fine"), default="default", help="of the scan"
    )
    parser.add_argument(
        "--draws",
        type=int,
        default=DRAWS,
        metavar="N",
        help=f"rehearse with N errors of the scan's metric world ({DRAWS})",
    )
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Prepare, cut, rehearse the dataset's courses, track both; exit 1 if a figure misses its bar.

    Raises:
        ValueError: the folder is no dataset, or its photos make no room.
    """
    import numpy as np

    from benchmarks.evaluate.answers import Answer
    from benchmarks.evaluate.dataset.layout import read_dataset
    from benchmarks.evaluate.dataset.prediction import prediction_rows
    from benchmarks.evaluate.dataset.preparing import prepare_dataset
    from benchmarks.evaluate.dataset.rehearsed_pictures import RehearsedPictures
    from benchmarks.evaluate.dataset.tracking import filmed
    from scenes.render.native import NativeRenderer
    from sim.reality.look import SplatLook
    from sim.reality.room import scanned_room
    from sim.reality.world_error import drawn_error
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code

    dataset, progress = read_dataset(args.folder), text_progress()
    kept = nullcontext(args.out) if args.out else tempfile.TemporaryDirectory()
    with kept as name:
        folder = Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        prepared = prepare_dataset(
            dataset,
            folder,
            quality=args.quality,
            steps=None,
            seed=args.seed,
            progress=progress,
            clock=time.monotonic,
        )
        renderer = NativeRenderer()
        scene, parts = _taken_apart(prepared, renderer, folder, seed=args.seed, progress=progress)
        assert scene.reality is not None
        room = scanned_room(scene, parts, renderer)
        progress.finish(f"{len(parts.objects)} objects")
        tracked = _tracking(dataset, prepared, seed=args.seed, progress=progress)
        measured = tracked(filmed, "the real")
        rehearsed: list[Answer] = []
        for draw in range(max(1, args.draws)):
            error = drawn_error(scene.reality, np.random.default_rng([args.seed, draw]))
            look = SplatLook(room, renderer=renderer)
            with closing(RehearsedPictures(dataset, prepared, room, look, error=error)) as pictures:
                rehearsed += tracked(pictures, f"rehearsed ({draw + 1} of {args.draws})").answers
    for object_id, why in parts.missing.items():
        print(f"{object_id} stands still in the rehearsal: {why}", file=sys.stderr)
    rows = prediction_rows(dataset, rehearsed=rehearsed, measured=measured.answers)
    if args.json:
        print(json.dumps(as_json("evaluate twin", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def _taken_apart(
    prepared: PreparedDataset,
    renderer: NativeRenderer,
    folder: Path,
    *,
    seed: int,
    progress: Progress,
) -> tuple[ScenePackage, TakenApart]:
    """Train the photos a second time; return the scene with that, and its parts."""
    from scenes.prepare.reality import with_reality
    from sim.reality.parts import parts_of
    from studio.console.progress import StageProgress

    stages = StageProgress(progress)
    scene = with_reality(
        prepared.package,
        folder / "room.gnx.prepare",
        seed=seed,
        seconds=time.monotonic,
        progress=stages,
    )
    stages.finish()
    assert scene.reality is not None
    progress.begin("taking the second reconstruction apart")
    parts = parts_of(
        scene,
        scene.reality,
        renderer,
        folder=folder / "parts",
        progress=lambda done, note: progress.advance(done, note),
    )
    return scene, parts


def _tracking(
    dataset: Dataset, prepared: PreparedDataset, *, seed: int, progress: Progress
) -> Callable[[Pictures, str], Tracked]:
    """Return a function that tracks pictures, which it is given with a name for them."""
    from benchmarks.evaluate.dataset.tracking import CameraError, track_dataset
    from studio.session.trackers.methods import make_method

    method = make_method("own", prepared.package)

    def tracked(picture_of: Pictures, what: str) -> Tracked:
        progress.begin(f"tracking {what} pictures")
        found = track_dataset(
            dataset,
            prepared,
            method,
            camera_error=CameraError(),
            seed=seed,
            stopwatch_ns=time.perf_counter_ns,
            begin=lambda session: progress.advance(0.0, session),
            picture_of=picture_of,
            chained=False,
        )
        progress.finish(f"{len(found.answers)} answers")
        return found

    return tracked
