"""`nexus bench proposals`: what people move, looked for around where it was known."""

from __future__ import annotations

import argparse
import time

from benchmarks.verbs.bench.rooms_by_seed import add_arguments, measured_in_rooms, print_rows

__all__ = ["add_arguments", "run"]


def run(args: argparse.Namespace) -> int:
    """Look for it; exit 1 if a figure misses its bar."""
    from benchmarks.evaluate.filmed.takes import TakeCache
    from benchmarks.tracking.proposals import measure_proposals, proposal_rows
    from benchmarks.tracking.windows import LabelledRoom

    cache = TakeCache()
    results = measured_in_rooms(
        args,
        lambda seed: measure_proposals(
            LabelledRoom(seed, cache=cache), stopwatch_ns=time.perf_counter_ns
        ),
    )
    rows = proposal_rows(item for found in results for item in found)
    return print_rows(args, rows, verb="bench proposals")
