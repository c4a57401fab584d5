"""`nexus evaluate preparation`: films a built-in room, prepares it and judges what came out."""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from contextlib import nullcontext
from pathlib import Path

TABLES = ("prepare", "train", "cut")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "scene", nargs="?", default="lab", choices=("lab", "desk"), help="built-in room (lab)"
    )
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="keep captures, packages and reports here"
    )
    parser.add_argument("--only", choices=TABLES, nargs="+", help="only some of the tables")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Film, prepare, judge; exit 1 if a figure misses its bar."""
    from benchmarks.evaluate.preparation_scores import evaluate
    from studio.console.progress import text_progress
    from studio.console.rows import as_json, as_table, exit_code

    kept = nullcontext(args.out) if args.out else tempfile.TemporaryDirectory()
    with kept as folder:
        rows = evaluate(
            args.scene,
            Path(folder),
            seed=args.seed,
            tables=set(args.only or TABLES),
            progress=text_progress(),
            clock=time.monotonic,
        )
    if args.json:
        print(json.dumps(as_json("evaluate preparation", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)
