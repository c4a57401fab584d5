"""`nexus bench headset`: the shared origin from two codes, along simulated walks."""

from __future__ import annotations

import argparse
import json
import sys
import time


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("--rooms", nargs="+", default=["lab", "desk"], help="(lab desk)")
    parser.add_argument("--walks", type=int, default=5, metavar="N", help="in each room (5)")
    parser.add_argument("--seconds", type=float, default=40.0, metavar="S", help="each (40)")
    parser.add_argument("--seed", type=int, default=0, help="of the first walk")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Measure; exit 1 if a figure misses its bar."""
    from benchmarks.headset.origin import measure_walk, walk_rows
    from studio.console.rows import as_json, as_table, exit_code

    if args.walks < 1 or not 5.0 <= args.seconds <= 600.0:
        raise ValueError("wanted --walks of 1 or more, --seconds of 5 to 600")
    results = []
    for room in args.rooms:
        for seed in range(args.seed, args.seed + args.walks):
            result = measure_walk(room, seed, seconds=args.seconds, now_ns=time.perf_counter_ns)
            results.append(result)
            print(
                f"{room} {seed}: {result.mm:.1f} mm ({result.mm_p95:.1f}), {result.deg:.3f}° "
                f"({result.deg_p95:.3f}), codes in {result.seen} of {result.pictures} pictures",
                file=sys.stderr,
                flush=True,
            )
    rows = walk_rows(results)
    print(
        json.dumps(as_json("bench headset", rows, args.seed), indent=2)
        if args.json
        else as_table(rows)
    )
    return exit_code(rows)
