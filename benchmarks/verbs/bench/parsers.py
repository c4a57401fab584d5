"""`nexus bench parsers`: hostile bytes for every parser that a network reaches."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence

from benchmarks.wire.fuzz import FuzzError, fuzz, targets
from studio.console.rows import Row, as_json, as_table, at_most, exit_code

INPUTS = 500
"""Hostile inputs for each parser, some seconds for all of them together."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument(
        "--parsers", nargs="+", choices=sorted(targets()), metavar="NAME", help="only these"
    )
    parser.add_argument(
        "--inputs", type=int, default=INPUTS, metavar="N", help=f"for each parser ({INPUTS})"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the first input (0)")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Give every parser its inputs; exit 1 if one neither reads nor refuses."""
    if args.inputs < 1:
        raise ValueError(f"--inputs {args.inputs}: wanted at least 1")
    rows = measure_parsers(args.parsers or tuple(targets()), args.inputs, args.seed)
    if args.json:
        print(json.dumps(as_json("bench parsers", rows, args.seed), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def measure_parsers(names: Sequence[str], inputs: int, first_seed: int) -> list[Row]:
    """Return how many parsers failed otherwise than by a refusal; each is named on stderr."""
    crashes = 0
    for name in names:
        try:
            counts = fuzz(name, inputs, first_seed)
        except FuzzError as error:
            crashes += 1
            print(error, file=sys.stderr)
        else:
            print(f"{name}: {counts.read} read, {counts.refused} refused", file=sys.stderr)
    return [at_most("live.fuzz.crashes", crashes, "", bar=0)]
