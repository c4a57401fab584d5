"""`nexus bench likelihood`: true, wrong and covered poses of labelled pictures, weighed."""

from __future__ import annotations

import argparse

from benchmarks.verbs.bench.rooms_by_seed import add_arguments, measured_in_rooms, print_rows

__all__ = ["add_arguments", "run"]


def run(args: argparse.Namespace) -> int:
    """Weigh them; exit 1 if a figure misses its bar."""
    from benchmarks.evaluate.filmed.takes import TakeCache
    from benchmarks.tracking.likelihood import likelihood_rows, measure_likelihood
    from benchmarks.tracking.windows import LabelledRoom

    cache = TakeCache()
    results = measured_in_rooms(
        args, lambda seed: measure_likelihood(LabelledRoom(seed, cache=cache))
    )
    return print_rows(args, likelihood_rows(results), verb="bench likelihood")
