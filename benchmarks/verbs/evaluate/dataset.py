"""`nexus evaluate dataset FOLDER`: a foreign room with exact truth, by the product's own verbs."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmarks.evaluate.answers import Answer


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("folder", type=Path, help="photos, 360° pictures and truth of a room")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="keep the package, its stages and all answers here"
    )
    parser.add_argument(
        "--quality", choices=("preview", "default", "fine"), default="default", help="of training"
    )
    parser.add_argument("--steps", type=int, metavar="N", help="end the training after so many")
    parser.add_argument(
        "--method", choices=("own", "paper"), default="own", help="tracker (default: own)"
    )
    parser.add_argument(
        "--pose-error-deg", type=float, default=0.5, help="of the camera's known pose (0.5)"
    )
    parser.add_argument("--pose-error-cm", type=float, default=1.0, help="likewise, in cm (1.0)")
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Prepare, cut, track, judge; exit 1 if a figure misses its bar.

    Raises:
        ValueError: the folder is no dataset; names the file and the field.
    """
    from benchmarks.evaluate.dataset.layout import read_dataset
    from benchmarks.evaluate.dataset.preparing import prepare_dataset
    from benchmarks.evaluate.dataset.scoring import preparation_rows, tracking_rows
    from benchmarks.evaluate.dataset.tracking import CameraError, track_dataset
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code
    from studio.evaluate.perfect_detector import PerfectDetector
    from studio.session.trackers.methods import make_method

    dataset = read_dataset(args.folder)
    progress = text_progress()
    kept = nullcontext(args.out) if args.out else tempfile.TemporaryDirectory()
    with kept as name:
        folder = Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        prepared = prepare_dataset(
            dataset,
            folder,
            quality=args.quality,
            steps=args.steps,
            seed=args.seed,
            progress=progress,
            clock=time.monotonic,
        )
        detector = PerfectDetector() if args.method == "paper" else None
        method = make_method(
            args.method, prepared.package, detector, stopwatch=time.perf_counter_ns
        )
        progress.begin(f"tracking with {args.method}")
        tracked = track_dataset(
            dataset,
            prepared,
            method,
            camera_error=CameraError(args.pose_error_deg, args.pose_error_cm),
            seed=args.seed,
            stopwatch_ns=time.perf_counter_ns,
            begin=lambda session: progress.advance(0.0, session),
            shown=None if detector is None else detector.see_masks,
        )
        progress.finish(f"{len(tracked.answers)} answers")
        if args.out:
            answers = folder / f"answers-{args.method}.json"
            answers.write_text(json.dumps([_plain(a) for a in tracked.answers]), encoding="utf-8")
            print(f"answers: {answers}", file=sys.stderr)
    for line in tracked.camera_lines:
        print(line, file=sys.stderr)
    rows = preparation_rows(prepared, quality=args.quality) + tracking_rows(dataset, tracked)
    if args.json:
        print(json.dumps(as_json("evaluate dataset", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def _plain(answer: Answer) -> dict[str, Any]:
    return {**asdict(answer), "state": None if answer.state is None else str(answer.state)}
