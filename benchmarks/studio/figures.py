"""The rows of `nexus bench studio`: every figure from a process of its own, held to its bar."""

from __future__ import annotations

import subprocess

import numpy as np

from benchmarks.studio.process import measured
from studio.console.rows import Row, at_least, at_most

OPENINGS = 3
"""Processes that are started for the time to the window; their median counts."""

WINDOW_S, PICTURE_S, FPS, REFINED_MS, INPUT_MS, INPUT_WORST_MS = 1.0, 4.0, 15.0, 300.0, 100.0, 500.0
LEAK_MB = 1.0
"""Bars of the studio's figures."""


def opening_rows() -> list[Row]:
    """Time to the window and to the first picture of the lab."""
    found = [measured("opening") for _ in range(OPENINGS)]
    shown = float(np.median([f["window_s"] for f in found]))
    picture = float(np.median([f["first_picture_s"] for f in found]))
    return [
        at_most("studio.window_s", shown, "s", bar=WINDOW_S),
        at_most("studio.first_picture_s", picture, "s", bar=PICTURE_S),
    ]


def orbiting_rows() -> list[Row]:
    """Pictures a second while the view moves, and how soon it is drawn in full."""
    found = measured("orbiting")
    return [
        at_least("studio.fps", found["fps"], "1/s", bar=FPS),
        at_most("studio.refined_ms", found["refined_ms"], "ms", bar=REFINED_MS),
    ]


def answering_rows() -> list[Row]:
    """How soon an input is answered while a session plays."""
    took = measured("answering")["input_ms"]
    return [
        at_most("studio.input_ms.p95", float(np.quantile(took, 0.95)), "ms", bar=INPUT_MS),
        at_most("studio.input_ms.max", float(max(took)), "ms", bar=INPUT_WORST_MS),
    ]


def open_close_rows(rounds: int) -> list[Row]:
    """Crashes and memory over rounds of open, rehearse, close."""
    try:
        resident = measured("open_close", str(rounds))["resident_mb"]
    except subprocess.CalledProcessError:
        return [at_most("studio.open_close.crashes", 1, "", bar=0)]
    leak = float(np.polyfit(range(len(resident)), resident, 1)[0]) if len(resident) > 1 else 0.0
    return [
        at_most("studio.open_close.crashes", 0, "", bar=0),
        at_most("studio.open_close.leak_mb", leak, "MB", bar=LEAK_MB),
    ]
