"""`nexus bench studio`: how fast the window opens, draws and answers, and what a crash costs."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the machine is described with it, which takes a moment
    from studio.console.rows import Row


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "--rounds", type=int, default=5, metavar="N", help="of open, rehearse, close (5)"
    )
    parser.add_argument("--kills", type=int, default=5, metavar="N", help="at random moments (5)")
    parser.add_argument("--no-seek", action="store_true", help="leave out the long recording")
    parser.add_argument(
        "--steps",
        nargs="*",
        metavar="STEP",
        help="only the steps of a designer's, operator's and tester's day, or some: D3",
    )
    parser.add_argument("--no-steps", action="store_true", help="leave the steps out")
    parser.add_argument(
        "--soak-minutes",
        type=float,
        metavar="N",
        help="only keep a session going for so long; soak.csv in --out says how it went",
    )
    parser.add_argument(
        "--use-minutes",
        type=float,
        metavar="N",
        help="only open, rehearse, fork, film and close in one window for so long: its memory",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/bench-studio"), help="folder (out/bench-studio)"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Measure; exit 1 if a figure misses its bar."""
    from benchmarks.studio.soaking import soak_rows
    from benchmarks.studio.tasks.steps import OPEN, STEPS
    from benchmarks.studio.using import use_rows
    from studio.console.display import why_no_window
    from studio.console.rows import as_json, as_table, exit_code

    unknown = sorted(set(args.steps or ()) - set(STEPS))
    if unknown:
        raise ValueError(f"--steps {' '.join(unknown)}: wanted some of D1 to D10, O1 …, T1 …")
    no_window = why_no_window()
    if no_window is not None:
        raise ValueError(f"{no_window}; on a server: xvfb-run -a ./nexus bench studio")
    reasons: dict[str, str] = {}
    if args.soak_minutes:
        rows = soak_rows(args.soak_minutes, args.out)
    elif args.use_minutes:
        rows = use_rows(args.use_minutes, args.out / "use")
    else:
        rows = [] if args.steps is not None else _window_rows(args)
        if not args.no_steps:
            rows += _day_rows(rows, args.steps or ())
            reasons = OPEN
    if args.json:
        print(json.dumps({**as_json("bench studio", rows, None), "open": reasons}, indent=2))
    else:
        print(as_table(rows))
        print("".join(f"\n{step:4}is not measured here: {why}" for step, why in reasons.items()))
    return exit_code(rows)


def _window_rows(args: argparse.Namespace) -> list[Row]:
    from benchmarks.studio.figures import (
        answering_rows,
        open_close_rows,
        opening_rows,
        orbiting_rows,
    )
    from benchmarks.studio.killing import kill_rows
    from benchmarks.studio.seeking import seek_rows
    from benchmarks.studio.tasks.first_time import task_rows
    from benchmarks.studio.walking import walked_rows

    rows: list[Row] = []
    for part in (opening_rows, orbiting_rows, answering_rows):
        print(f"{part.__name__.removesuffix('_rows')} …", file=sys.stderr)
        rows += part()
    if not args.no_seek:
        with tempfile.TemporaryDirectory() as folder:
            rows += seek_rows(Path(folder))
    rows += open_close_rows(args.rounds)
    rows += kill_rows(args.kills)
    print("walking …", file=sys.stderr)
    rows += walked_rows()
    print("first-time tasks …", file=sys.stderr)
    return rows + task_rows()


def _day_rows(rows: list[Row], only: list[str] | tuple[str, ...]) -> list[Row]:
    from benchmarks.studio.tasks.steps import in_order, open_rows, repeated_rows, step_rows

    with tempfile.TemporaryDirectory(prefix="nexus-steps-") as folder:
        found = step_rows(Path(folder), only)
    return in_order([*repeated_rows(rows), *found, *([] if only else open_rows())])
