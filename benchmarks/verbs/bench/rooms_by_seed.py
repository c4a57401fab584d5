"""Flags, rooms and output that the benches of the tracker's parts share."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from typing import TypeVar

from benchmarks.verbs.evaluate.random_rooms import JUDGED_SEEDS, seeds_of
from studio.console.rows import Row, as_json, as_table, exit_code

Result = TypeVar("Result")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument(
        "--seeds",
        default=JUDGED_SEEDS,
        metavar="A-B",
        help=f"rooms from A to B, or one room ({JUDGED_SEEDS}, for judging; 100-107 to develop on)",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def measured_in_rooms(args: argparse.Namespace, measure: Callable[[int], Result]) -> list[Result]:
    """Return what is measured in every room, by its seed; each is announced on stderr.

    Raises:
        ValueError: `--seeds` is no range of seeds.
    """
    results: list[Result] = []
    for seed in seeds_of(args.seeds):
        print(f"room {seed} …", file=sys.stderr, flush=True)
        results.append(measure(seed))
    return results


def print_rows(args: argparse.Namespace, rows: Sequence[Row], *, verb: str) -> int:
    """Print figures as a table or as JSON, and return the exit status that they mean."""
    if args.json:
        print(json.dumps({**as_json(verb, rows), "seeds": seeds_of(args.seeds)}, indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)
