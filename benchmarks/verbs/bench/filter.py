"""`nexus bench filter`: how long what people move is reported wrongly, while it can be seen."""

from __future__ import annotations

import argparse

from benchmarks.verbs.bench.rooms_by_seed import add_arguments, measured_in_rooms, print_rows

__all__ = ["add_arguments", "run"]


def run(args: argparse.Namespace) -> int:
    """Track it; exit 1 if a figure misses its bar."""
    from benchmarks.tracking.recovery import measure_recovery, recovery_rows

    results = measured_in_rooms(args, measure_recovery)
    rows = recovery_rows(right for of_room in results for right in of_room)
    return print_rows(args, rows, verb="bench filter")
