"""`nexus compare`: one run held against another, on one page."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

DEFAULT_OUT = Path("out/compare.html")
LARGEST_TOLERANCE = 10.0
"""Share of a figure: more would let everything pass."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    for name, what in (("a", "the run held to be good"), ("b", "the run held against it")):
        parser.add_argument(
            name, metavar=name.upper(), type=_folder, help=f"{what}: folder of a rehearsal or fork"
        )
    parser.add_argument(
        "--out",
        type=Path,
        default=DEFAULT_OUT,
        metavar="PAGE",
        help=f"the page; copies of the films go into a folder beside it ({DEFAULT_OUT})",
    )
    parser.add_argument(
        "--tolerance",
        type=_share,
        default=0.1,
        metavar="SHARE",
        help="how much worse a figure of B may be, as 10%% or 0.1 of A's (default: 10%%); "
        "differences up to 0.1 cm, 0.1 deg or 0.1 px never count, durations are not judged",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Compare; exit 1 if a figure got worse by more than the tolerance."""
    from studio.compare.comparison import read_comparison
    from studio.compare.page import headline, write_comparison
    from studio.compare.verdicts import as_values
    from studio.console.machine import describe_machine, program_version
    from studio.console.progress import text_progress

    if args.out.is_dir():
        raise ValueError(f"{args.out}: is a folder; give the page's file name with --out")
    progress = text_progress()
    progress.begin("reading both runs")
    comparison = read_comparison(args.a, args.b, tolerance=args.tolerance)
    progress.finish()
    progress.begin("drawing the page")
    write_comparison(comparison, args.out)
    progress.finish()
    if args.json:
        values = {
            "verb": "compare",
            "version": program_version(),
            "machine": describe_machine(),
            "a": str(args.a),
            "b": str(args.b),
            "tolerance": args.tolerance,
            "rows": as_values(comparison.rows),
        }
        print(json.dumps(values, indent=2))
    else:
        print(headline(comparison))
        for row in comparison.worse:
            print(f"  {row.name}: {row.a:.4g} → {row.b:.4g} {row.unit}".rstrip())
    print(f"page: {args.out}", file=sys.stderr)
    return int(bool(comparison.worse))


def _folder(text: str) -> Path:
    from studio.compare.run import what_is_missing

    folder = Path(text)
    missing = what_is_missing(folder)
    if missing is not None:
        raise argparse.ArgumentTypeError(missing)
    return folder


def _share(text: str) -> float:
    try:
        share = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        share = float("nan")
    if not 0.0 <= share <= LARGEST_TOLERANCE:
        raise argparse.ArgumentTypeError(
            f"{text!r}, wanted a share such as 10% or 0.1, from 0 to {LARGEST_TOLERANCE:.0%}"
        )
    return share
