"""The rows of `nexus bench studio`: every figure from a process of its own, held to its bar."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from studio.app.measure.process import command, measured
from studio.app.model.documents.autosave import recoverable
from studio.console.rows import Row, at_least, at_most

OPENINGS = 3
"""Processes that are started for the time to the window; their median counts."""

WINDOW_S, PICTURE_S, FPS, REFINED_MS, INPUT_MS, INPUT_WORST_MS = 1.0, 4.0, 15.0, 300.0, 100.0, 500.0
LEAK_MB, LOST_S = 1.0, 2.0
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
    # The first rounds fill caches: imports, fonts, the renderer's buffers.
    settled = resident[len(resident) // 2 :]
    leak = float(np.polyfit(range(len(settled)), settled, 1)[0]) if len(settled) > 1 else 0.0
    return [
        at_most("studio.open_close.crashes", 0, "", bar=0),
        at_most("studio.open_close.leak_mb", leak, "MB", bar=LEAK_MB),
    ]


def kill_rows(times: int, seed: int = 0) -> list[Row]:
    """Seconds of edits that a kill at a random moment costs, the worst of some."""
    rng = np.random.default_rng(seed)
    lost = [_lost_s(float(rng.uniform(0.3, 3.0))) for _ in range(times)]
    return [at_most("studio.kill9.lost_s.max", max(lost), "s", bar=LOST_S)]


def _lost_s(after_s: float) -> float:
    """Between the last edit that is there again and the kill."""
    with tempfile.TemporaryDirectory() as home:
        child = subprocess.Popen(command("editing", home), stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None
        made: dict[int, float] = {}
        killed = None
        for line in child.stdout:
            words = line.split()
            if len(words) == 2:
                made[int(words[0])] = float(words[1])
            first = next(iter(made.values()), None)
            if first is not None and time.monotonic() - first > after_s and killed is None:
                killed = time.monotonic()
                os.kill(child.pid, signal.SIGKILL)
        child.wait()
        found = recoverable(Path(home))
        kept = found[0].document.markers[0].t_ns if found else -1
        unkept = [t for number, t in made.items() if number > kept]
        return (killed or 0.0) - min(unkept) if unkept else 0.0
