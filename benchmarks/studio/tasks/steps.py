"""The days of designer, operator and tester step by step: which are measured here, which are open.

Every measurement runs in a process of its own, may give figures of several steps, and names each
row `studio.STEP.FIGURE` or `live.WHAT.FIGURE`.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.studio.process import measured
from studio.console.rows import Row, at_least, at_most

STEPS = tuple(f"{day}{number}" for day in "DOT" for number in range(1, 11))

MEASUREMENTS: dict[str, tuple[str, ...]] = {
    "own_room": ("D3",),
    "metric_scale": ("D4",),
    "cutting": ("D5",),
    "by_hand": ("D6",),
    "designing": ("D7", "D8", "D10", "O10"),
    "project": ("O1", "O2"),
    "live": ("O5",),
    "bumped": ("O6",),
    "generating": ("T1", "T3"),
    "judging": ("T5", "T7", "T9"),
    "plug_in": ("T8",),
}
"""Steps by the measurement that gives their rows."""

LIVE_ROWS = {"bump": "O6"}
"""Steps by the second part of rows `live.…`, which state what a live camera must do."""

OPEN: dict[str, str] = {
    "D1": "needs a clean machine: `./nexus setup` fetches about 0.8 GB (bar 400 MB)",
    "O3": "`nexus live lab --simulated` connects to a simulated camera; a real one was not tried",
    "O4": "`nexus evaluate recover` measures it in minutes",
    "O7": "`nexus live lab --simulated` cuts its camera off for 20 s",
    "O9": "`tests/studio/app/devices/test_tracker_options.py` changes a running tracker",
    "O8": "needs the browser client, which does not exist yet",
    "T2": "`tests/sim/wire` has ffmpeg and GStreamer on the other side",
    "T4": "`nexus evaluate` prints the paper's tables in many minutes",
    "T6": "`./nexus test` is the matrix itself",
    "T10": "`nexus bench studio --soak-minutes 60` measures it, in real time",
}
"""Why a step has no figure here."""

DRAWN_BAR_S, FPS_BAR, SEEK_BAR_MS = 6.0, 10.0, 200.0
"""Bars of D2 and D9, whose figures other rows have."""


def step_rows(folder: Path, only: Sequence[str] = ()) -> list[Row]:
    """Measure the steps that need no device.

    Args:
        folder: for what they leave.
        only: steps such as "D3"; empty for all.
    """
    rows: list[Row] = []
    for name, steps in MEASUREMENTS.items():
        if only and not set(only) & set(steps):
            continue
        print(f"{name}: {', '.join(steps)} …", file=sys.stderr)
        where = folder / name
        where.mkdir(parents=True, exist_ok=True)
        try:
            found = measured("step", name, str(where))["rows"]
        except subprocess.CalledProcessError as error:
            print(f"{name}: its process ended with {error.returncode}", file=sys.stderr)
            rows += [at_most(f"studio.{step}.crashes", 1, "", bar=0) for step in steps]
            continue
        rows += [Row(**row) for row in found]
    return rows


def repeated_rows(rows: Sequence[Row]) -> list[Row]:
    """D2 and D9 from the rows that have their figures, if they were measured."""
    values = {row.name: row.value for row in rows if row.value is not None}
    found: list[Row] = []
    if "studio.first_picture_s" in values:
        first_s = values["studio.first_picture_s"]
        found.append(at_most("studio.D2.first_picture_s", first_s, "s", bar=DRAWN_BAR_S))
    if "studio.fps" in values:
        found.append(at_least("studio.D9.fps", values["studio.fps"], "1/s", bar=FPS_BAR))
    if "studio.seek_ms.p95" in values:
        seek_ms = values["studio.seek_ms.p95"]
        found.append(at_most("studio.D9.seek_ms.p95", seek_ms, "ms", bar=SEEK_BAR_MS))
    return found


def open_rows() -> list[Row]:
    """A row without a value for every step that is not measured here."""
    return [Row(f"studio.{step}.open", None, "") for step in OPEN]


def in_order(rows: Sequence[Row]) -> list[Row]:
    """Steps in the order of their tables."""

    def place(row: Row) -> int:
        what = row.name.split(".")[1]
        return STEPS.index(LIVE_ROWS.get(what, what))

    return sorted(rows, key=place)
