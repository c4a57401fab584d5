"""`nexus bench twin`: the figures of the digital twin, from its camera to its forks."""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from benchmarks.twin import physics
from benchmarks.twin.camera import measure_camera
from benchmarks.twin.forks import INSTANTS_S, measure_forks
from studio.console.rows import Row, as_json, as_table, exit_code

NAMES: Mapping[str, str] = {
    "physics.real_time": "twin.realtime_factor",
    "physics.steps_per_s": "twin.steps_per_s",
    "physics.rescan.max.ms": "twin.edit_ms.max",
    "physics.rescan.jump.mm": "twin.edit_jump_mm.max",
    "physics.escaped": "twin.escaped",
    "physics.sunk.max.mm": "twin.rest_mm.max",
    "physics.sunk.p99.mm": "twin.rest_mm.p99",
    "physics.jitter.max.mm": "twin.jitter_mm.max",
}
"""Figures of `nexus bench physics` by the names that they have here."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of the verb."""
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--quick", action="store_true", help="fewer throws, and two forks")


def run(args: argparse.Namespace) -> int:
    """Measure and print; 1 if a figure missed its bar."""
    with tempfile.TemporaryDirectory(prefix="nexus-forks-") as folder:
        instants_s = INSTANTS_S[:2] if args.quick else INSTANTS_S
        forks = measure_forks(Path(folder), instants_s=instants_s)
    throws = physics.QUICK_THROWS if args.quick else physics.THROWS
    rows = [
        *measure_camera(),
        *(_named(row) for row in physics.measure(throws=throws) if row.name in NAMES),
        *forks,
    ]
    if args.json:
        print(json.dumps(as_json("bench twin", rows, physics.SEED), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def _named(row: Row) -> Row:
    return replace(row, name=NAMES[row.name])
