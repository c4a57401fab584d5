"""The end report of a live session: figures as rows, and a page with what happened and changed."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from scenes.formats.storage.atomic import write_file
from studio.console.rows import Row, as_json
from studio.console.spoken import spoken
from studio.live.shortfalls import drop_words
from studio.live.status import LiveResult
from studio.reports.page import page
from studio.session.preflight import Check

REPORT_HTML, REPORT_JSON = "live.html", "live.json"
"""Names of the report's files beside the recording."""

HISTOGRAM_MS = (0, 20, 40, 60, 80, 100, 130, 200, 500, 1000, math.inf)
"""Edges of the delay histogram, milliseconds; 130 is the product's promise."""


def live_rows(result: LiveResult) -> list[Row]:
    """The figures of a session that need no truth."""
    camera, session = result.camera, result.session
    gaps = sum(event.kind == "camera-gap" for event in result.events)
    rows = [
        Row("live.duration_s", result.duration_s, "s"),
        Row("live.live_s", result.live_s, "s"),
        Row("live.frames", float(0 if session is None else session.frames), ""),
        Row("live.dropped", float(result.dropped), ""),
        Row("live.camera.pictures", float(camera.pictures), ""),
        Row("live.camera.damaged", float(camera.damaged), ""),
        Row("live.camera.connections", float(camera.connections), ""),
        Row("live.camera.gaps", float(gaps), ""),
        Row("live.recorder.unsaved", float(camera.unsaved), ""),
    ]
    return rows + result.latencies.rows()


def write_report(
    folder: Path,
    result: LiveResult,
    rows: Sequence[Row],
    *,
    scene: str,
    checks: Sequence[Check] = (),
) -> Path:
    """Write `live.html` and `live.json` into a folder; gives the page.

    Args:
        folder: of the recording.
        result: how the session went.
        rows: its figures, with those against a truth if there is one.
        scene: name of the room.
        checks: made before it went live.

    Raises:
        WriteError: the folder cannot be written into.
    """
    folder.mkdir(parents=True, exist_ok=True)
    begun_ns = min((event.t_ns for event in result.events), default=0)
    values = as_json("live", rows) | {
        "scene": scene,
        "events": [asdict(event) for event in result.events],
        "changes": [asdict(change) for change in result.changes],
        "checks": [asdict(check) for check in checks],
        "recording": None if result.recording is None else result.recording.name,
        "recording_failure": result.recording_failure,
    }
    text = page("live.html.j2").render(
        scene=scene,
        rows=rows,
        spoken=spoken,
        checks=checks,
        events=[(_clock(event.t_ns - begun_ns), event) for event in result.events],
        changes=[(_clock(change.t_ns - begun_ns), change.text) for change in result.changes],
        histogram=histogram(result),
        placed=None if result.placed is None else result.placed,
        calibration=_calibration(result),
        recording=None if result.recording is None else result.recording.name,
        recording_failure=result.recording_failure,
        drops=_drops(result),
    )
    write_file(folder / REPORT_JSON, [json.dumps(values, indent=2).encode()])
    write_file(folder / REPORT_HTML, [text.encode()])
    return folder / REPORT_HTML


def histogram(result: LiveResult) -> list[tuple[str, int, float]]:
    """Delays from a picture's last byte to its poses: range in words, count, share 0..1."""
    delays_ms = result.latencies.newest("whole") / 1e6
    counts, _ = np.histogram(delays_ms, bins=np.array(HISTOGRAM_MS))
    total = max(int(counts.sum()), 1)
    bars: list[tuple[str, int, float]] = []
    for low, high, count in zip(HISTOGRAM_MS, HISTOGRAM_MS[1:], counts, strict=False):
        words = f"{low:g} to {high:g} ms" if math.isfinite(high) else f"above {low:g} ms"
        bars.append((words, int(count), int(count) / total))
    return bars


def _drops(result: LiveResult) -> str:
    """Why pictures were left out, in words; empty if nearly all were tracked."""
    session, live_s = result.session, max(result.duration_s, 1e-3)
    if session is None:
        return ""
    came = session.frames + result.dropped
    words = drop_words(came_hz=came / live_s, tracked_hz=session.frames / live_s)
    return f"{result.dropped} of {came} pictures were not tracked. {words}" if words else ""


def _calibration(result: LiveResult) -> str:
    placed = result.placed
    if placed is None or placed.calibration is None:
        return "lenses and pose were not fitted"
    return placed.calibration.described()


def _clock(t_ns: int) -> str:
    seconds = t_ns / 1e9
    return f"{int(seconds // 60)}:{seconds % 60:04.1f}"
