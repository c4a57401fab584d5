"""Hours in one window: what a session costs in memory and delay while it goes on and on."""

from __future__ import annotations

import csv
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.studio.process import measured
from studio.console.rows import Row, at_most

SAMPLE_S = 10.0
"""Between two samples, seconds."""

WARM_UP = 0.1
"""Share of a soak that does not count, chosen: in its first minutes the session fills what it keeps
on purpose: the stills of its film, the last delays of every stage, the tracker's memory of how
objects look."""

SETTLED_S = 60.0
"""Shortest warm-up, seconds: libraries, fonts and the first searches of the tracker are loaded and
done well before."""

SESSION_S = 3600.0
"""Longest session that a scenario may have; a longer soak is several, one after the other."""

OVERTIME = 0.1
"""Share of a soak by which it may end late, besides `SETTLED_S`; later, the machine is too busy for
a session in real time, and is said to be."""

GROWTH_PERCENT, LATENCY_PERCENT = 10.0, 50.0
"""Bars: memory as the product's table has it; delays by so much, because other work on the machine
moves them more than a session does."""

LEG = (
    '  { do = "push", object = "chair-1", to = [-0.45, 0.4] },',
    '  { do = "walk", to = [-1.7, -1.5] },',
    '  { do = "stand", seconds = 4.0 },',
    '  { do = "push", object = "chair-1", to = [-0.75, 1.0] },',
    '  { do = "hide", object = "chair-2", seconds = 2.0 },',
    '  { do = "carry", object = "book-1", to = [2.4, 0.74], turn_deg = 60.0 },',
    '  { do = "carry", object = "book-1", to = [2.45, 0.35], turn_deg = -60.0 },',
)
"""What the person does over and over."""

LEG_S = 20.0
"""Shorter than a leg takes: so many legs as fit are never done before the session's end."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Figures of ten seconds of a soak.

    Attributes:
        t_s: since the soak began.
        resident_mb: memory of the process.
        frames: of the camera, shown since the sample before.
        frame_ms: from a frame to its tracks, 95 %; NaN without frames.
        late_ms: from a frame's capture to its tracks, 95 %: what the simulated camera is late by on
            a busy machine, too.
        input_ms: until an input was answered, 95 %.
        threads: of the process.
    """

    t_s: float
    resident_mb: float
    frames: int
    frame_ms: float
    late_ms: float
    input_ms: float
    threads: int


def scenario_of(seconds: float) -> str:
    """A scenario of so many seconds in which objects move until its end.

    It is played in real time, and its two pictures a second leave room for other work: on a machine
    that cannot keep up, frames would come later and later, whatever the window does.
    """
    legs = "\n".join(LEG * (int(seconds / LEG_S) + 1))
    return f"""# Objects move from the first minute to the last, for a measurement of hours.
room = "lab"
duration_s = {seconds:.1f}

[camera]
fps = 2
lens_size_px = 480
bitrate_mbps = 2.0

[[people]]
id = "local-user"
start = [-0.9, 2.0]
facing_deg = -60.0
actions = [
{legs}
]

[[remote]]
id = "remote-user"
path = [[-1.8, -1.6, 1.6], [-0.6, -1.7, 1.6], [0.2, 0.2, 1.65], [1.2, 1.2, 1.6]]
points_at = ["chair-1", "book-1"]
"""


def soak_rows(minutes: float, folder: Path) -> list[Row]:
    """Keep a window in a session for so long, and hold memory and delays to their bars.

    Args:
        minutes: how long.
        folder: for `soak.csv`, a line a sample, and what the session leaves.

    Raises:
        ValueError: it is too short to say anything.
    """
    if minutes * 60 < 2 * SETTLED_S:
        raise ValueError(f"a soak of {minutes:g} min says nothing: wanted at least 2 min")
    path = folder / "soak.csv"
    path.unlink(missing_ok=True)
    try:
        failure = measured("soaking", str(minutes * 60), str(folder))["failure"]
    except subprocess.CalledProcessError as error:
        failure = f"the process ended with {error.returncode}"
    samples = read_samples(path)
    if failure:
        print(f"soak: {failure}", file=sys.stderr)
    return [at_most("studio.soak.failures", int(bool(failure)), "", bar=0), *growth_rows(samples)]


def growth_rows(samples: Sequence[Sample]) -> list[Row]:
    """How much more memory and delay the last tenth has than the one after the warm-up."""
    if not samples:
        return []
    whole_s = samples[-1].t_s
    begin_s = max(WARM_UP * whole_s, SETTLED_S)
    window_s = max(WARM_UP * whole_s, 2 * SAMPLE_S)
    first = [s for s in samples if begin_s <= s.t_s <= begin_s + window_s]
    last = [s for s in samples if s.t_s >= whole_s - window_s]
    mb = _medians(first, last, lambda s: s.resident_mb)
    frame = _medians(first, last, lambda s: s.frame_ms)
    late = _medians(first, last, lambda s: s.late_ms)
    answer = _medians(first, last, lambda s: s.input_ms)
    return [
        at_most("studio.soak.rss_growth", _percent(*mb), "%", bar=GROWTH_PERCENT),
        at_most("studio.soak.latency_growth", _percent(*frame), "%", bar=LATENCY_PERCENT),
        Row("studio.soak.rss_mb", mb[1], "MB"),
        Row("studio.soak.frame_ms.p95", frame[1], "ms"),
        Row("studio.soak.late_ms.p95", late[1], "ms"),
        Row("studio.soak.input_ms.p95", answer[1], "ms"),
        Row("studio.soak.minutes", whole_s / 60, "min"),
    ]


def _medians(
    first: Sequence[Sample], last: Sequence[Sample], value: Callable[[Sample], float]
) -> tuple[float, float]:
    def median(samples: Sequence[Sample]) -> float:
        found = [value(s) for s in samples if not np.isnan(value(s))]
        return float(np.median(found)) if found else float("nan")

    return median(first), median(last)


def _percent(before: float, after: float) -> float:
    return 100.0 * (after / before - 1.0)


def read_samples(path: Path) -> list[Sample]:
    """Return the samples that a soak has written; none if it never got there."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Sample(
                float(line["t_s"]),
                float(line["resident_mb"]),
                int(line["frames"]),
                float(line["frame_ms"]),
                float(line["late_ms"]),
                float(line["input_ms"]),
                int(line["threads"]),
            )
            for line in csv.DictReader(file)
        ]


class Sampler:
    """Writes a sample whenever it is due; every one is on the disk at once.

    Args:
        path: of the table.
        resident_mb: memory of the process.
        threads: how many it has.
        frame_ms: what tracking took of the last so many frames, 95 %.
    """

    def __init__(
        self,
        path: Path,
        *,
        resident_mb: Callable[[], float],
        threads: Callable[[], int],
        frame_ms: Callable[[int], float],
    ) -> None:
        self._path, self._resident_mb, self._threads = path, resident_mb, threads
        self._tracking_ms = frame_ms
        self._begin_s = self._last_s = time.monotonic()
        self._late_ms: list[float] = []
        self._input_ms: list[float] = []
        path.parent.mkdir(parents=True, exist_ok=True)
        self._write([field.name for field in fields(Sample)], mode="w")

    def late(self, ms: float) -> None:
        """A frame's tracks came so long after its capture."""
        self._late_ms.append(ms)

    def answered(self, ms: float) -> None:
        """An input was answered after so long."""
        self._input_ms.append(ms)

    def tick(self) -> None:
        """Write a sample if it is due."""
        now = time.monotonic()
        if now - self._last_s < SAMPLE_S:
            return
        self._last_s = now
        sample = Sample(
            t_s=round(now - self._begin_s, 2),
            resident_mb=round(self._resident_mb(), 2),
            frames=len(self._late_ms),
            frame_ms=round(self._tracking_ms(len(self._late_ms)), 2),
            late_ms=_p95(self._late_ms),
            input_ms=_p95(self._input_ms),
            threads=self._threads(),
        )
        self._late_ms, self._input_ms = [], []
        self._write(astuple(sample), mode="a")

    def _write(self, values: Sequence[Any], *, mode: str) -> None:
        with self._path.open(mode, newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(values)


def _p95(values: Sequence[float]) -> float:
    return round(float(np.quantile(values, 0.95)), 2) if values else float("nan")
