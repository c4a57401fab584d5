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
        "--soak-minutes",
        type=float,
        metavar="N",
        help="only keep a session going for so long; soak.csv in --out says how it went",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/bench-studio"), help="folder (out/bench-studio)"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Measure; exit 1 if a figure misses its bar."""
    from studio.app.measure.soaking import soak_rows
    from studio.console.display import why_no_window
    from studio.console.rows import as_json, as_table, exit_code

    no_window = why_no_window()
    if no_window is not None:
        raise ValueError(f"{no_window}; on a server: xvfb-run -a ./nexus bench studio")
    rows = soak_rows(args.soak_minutes, args.out) if args.soak_minutes else _rows(args)
    print(
        json.dumps(as_json("bench studio", rows, None), indent=2) if args.json else as_table(rows)
    )
    return exit_code(rows)


def _rows(args: argparse.Namespace) -> list[Row]:
    from studio.app.measure.figures import (
        answering_rows,
        kill_rows,
        open_close_rows,
        opening_rows,
        orbiting_rows,
    )
    from studio.app.measure.seeking import seek_rows

    rows: list[Row] = []
    for part in (opening_rows, orbiting_rows, answering_rows):
        print(f"{part.__name__.removesuffix('_rows')} …", file=sys.stderr)
        rows += part()
    if not args.no_seek:
        with tempfile.TemporaryDirectory() as folder:
            rows += seek_rows(Path(folder))
    rows += open_close_rows(args.rounds)
    rows += kill_rows(args.kills)
    return rows
