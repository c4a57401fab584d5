"""`nexus evaluate cuts`: objects cut out of rooms that nobody tuned on, against true meshes."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from benchmarks.verbs.evaluate.random_rooms import JUDGED_SEEDS, seeds_of
from scenes.package import DISTRIBUTION

if TYPE_CHECKING:
    from benchmarks.evaluate.cuts.capturing import Notes
    from benchmarks.evaluate.cuts.refining import RefineScore
    from benchmarks.evaluate.cuts.scores import CutScore

REFINED = "refined"
"""Models of random rooms' objects, refined after a cut with two boxes and by the truth's labels."""

WAYS = ("click", "one_box", "two_boxes", "three_boxes", "unmarked", REFINED)
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
        "--only",
        choices=WAYS,
        nargs="+",
        default=WAYS,
        help="only these ways of marking, or what refinement makes of the cuts",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Film, prepare, cut, judge; exit 1 if a figure misses its bar.

    Raises:
        ValueError: the seeds are out of range, or a folder is no dataset.
    """
    from benchmarks.evaluate.cuts.cases import cases_of
    from benchmarks.evaluate.cuts.judging import capture_rows, captures_of, judged
    from benchmarks.evaluate.cuts.refining import refine_rows, refine_table, refined_scores
    from benchmarks.evaluate.cuts.rows import breakdown, cut_rows
    from benchmarks.evaluate.cuts.true_views import true_room
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code

    seeds = seeds_of(args.seeds or JUDGED_SEEDS) if args.seeds or not args.dataset else []
    folder = args.captures or Path(platformdirs.user_cache_dir(DISTRIBUTION)) / "cuts"
    progress = text_progress()
    scores: list[CutScore] = []
    refined: list[RefineScore] = []
    made: list[tuple[Notes, float]] = []
    ways = [way for way in args.only if way != REFINED]
    rooms = captures_of(seeds, args.dataset, folder=folder, progress=progress)
    for number, (notes, capture) in enumerate(rooms):
        made.append((notes, capture.off_m))
        scores += judged(capture, ways=ways, progress=progress) if ways else []
        # A dataset's room has photos, and no picture from anywhere else.
        if REFINED in args.only and number < len(seeds):
            draw = partial(true_room, seeds[number])
            refined += refined_scores(cases_of(capture), draw=draw, progress=progress)
    rows = [*cut_rows(scores), *refine_rows(refined), *capture_rows(made)]
    if args.json:
        listed = {
            "captures": [asdict(notes) for notes, _ in made],
            "objects": [_plain(score) for score in scores],
            "refined": [_plain(score) for score in refined],
        }
        print(json.dumps({**as_json("evaluate cuts", rows), **listed}, indent=2))
    else:
        tables = [refine_table(refined)] if refined else []
        print("\n\n".join([*breakdown(scores), *tables, as_table(rows)]))
    return exit_code(rows)


def _plain(score: CutScore | RefineScore) -> dict[str, object]:
    """Figures that JSON can say: null for what was not measured."""
    return {
        name: None if isinstance(value, float) and math.isnan(value) else value
        for name, value in asdict(score).items()
    }
