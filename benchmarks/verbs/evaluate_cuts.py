"""`nexus evaluate cuts`: objects cut out of rooms that nobody tuned on, against true meshes."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from benchmarks.verbs.evaluate_random_rooms import JUDGED_SEEDS, seeds_of
from scenes.package import DISTRIBUTION

if TYPE_CHECKING:
    from benchmarks.evaluate.cuts.capturing import Notes
    from benchmarks.evaluate.cuts.scores import CutScore

WAYS = ("click", "one_box", "two_boxes", "three_boxes", "unmarked")
"""Ways of marking; unmarked are the product's proposals, and the truth's own labels."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "--seeds", metavar="A-B",
        help=f"random rooms from A to B, or one ({JUDGED_SEEDS}, for judging; 100-107 to develop "
        "on); none where a dataset is given alone",
    )  # fmt: skip
    parser.add_argument(
        "--dataset", type=Path, action="append", default=[], metavar="FOLDER",
        help="also the photos of a folder with exact truth, as of `nexus evaluate dataset`",
    )  # fmt: skip
    parser.add_argument(
        "--captures", type=Path, metavar="DIR",
        help="keep photos and prepared rooms here (default: the user's cache): a room takes "
        "minutes to make, a cut seconds",
    )  # fmt: skip
    parser.add_argument(
        "--only", choices=WAYS, nargs="+", default=WAYS, help="only these ways of marking"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Film, prepare, cut, judge; exit 1 if a figure misses its bar.

    Raises:
        ValueError: the seeds are out of range, or a folder is no dataset.
    """
    from benchmarks.evaluate.cuts.judging import capture_rows, captures_of, judged
    from benchmarks.evaluate.cuts.rows import breakdown, cut_rows
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code

    seeds = seeds_of(args.seeds or JUDGED_SEEDS) if args.seeds or not args.dataset else []
    folder = args.captures or Path(platformdirs.user_cache_dir(DISTRIBUTION)) / "cuts"
    progress = text_progress()
    scores: list[CutScore] = []
    made: list[tuple[Notes, float]] = []
    for notes, capture in captures_of(seeds, args.dataset, folder=folder, progress=progress):
        made.append((notes, capture.off_m))
        scores += judged(capture, ways=args.only, progress=progress)
    rows = [*cut_rows(scores), *capture_rows(made)]
    if args.json:
        values = as_json("evaluate cuts", rows)
        rooms, objects = [asdict(notes) for notes, _ in made], [asdict(s) for s in scores]
        print(json.dumps({**values, "captures": rooms, "objects": objects}, indent=2))
    else:
        print("\n\n".join([*breakdown(scores), as_table(rows)]))
    return exit_code(rows)
