"""The stage figures of `nexus bench raster`: where time goes, how near the blend is to its limit.

All times are CPU time of one thread, so that other programs on the machine matter little.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.raster.stages import LaneCount, Stages, stages_of
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from studio.console.rows import Row, at_least

SCALAR_BAR = 20.0
PEAK_BAR = 0.55
PEAK_ROUNDS = 200
SCALAR_REPEATS = 3
STAGES = ("project", "sort", "bin", "blend")

View = tuple[Pinhole | Fisheye, Pose]


@dataclass(frozen=True, slots=True)
class _Split:
    """CPU milliseconds of every stage of one scene, all its pictures together, repeat by repeat."""

    stages: tuple[Stages, ...]
    times_ms: dict[str, list[float]]


def stage_rows(
    native: NativeRenderer,
    name: str,
    objects: Sequence[PosedSplats],
    views: Sequence[View],
    repeats: int,
) -> list[Row]:
    """Return the time of each stage of a scene, and how well its blend uses its lanes."""
    split = _split(native, objects, views, repeats)
    rows = []
    for stage, times in split.times_ms.items():
        low, median, high = np.percentile(times, [25, 50, 75])
        title = f"raster.{name}.stage.{stage}.1t.ms"
        rows.append(Row(title, float(median), "ms", spread=float(high - low)))
    lanes = _lanes(split, native.instructions)
    blend_s = float(np.median(split.times_ms["blend"])) / 1e3
    useful = lanes.useful / lanes.processed
    rows.append(Row(f"raster.{name}.useful_blends", lanes.useful / blend_s / 1e6, "M/s"))
    return [*rows, Row(f"raster.{name}.lanes_used", useful, "")]


def blend_rows(
    native: NativeRenderer, objects: Sequence[PosedSplats], view: View, repeats: int
) -> list[Row]:
    """The blend of one picture against the portable kernel and against the inner loop alone.

    The kernels take turns, and so do the picture and the inner loop, so that what slows the machine
    down slows both.
    """
    split = _split(native, objects, [view], 1)
    stages = split.stages[0]
    lanes = stages.count_lanes(native.instructions)
    ratios, fractions, peaks = [], [], []
    for round_ in range(repeats):
        blend_ms = _cpu_ms(lambda: stages.blend(native.instructions))
        peak_ms = _cpu_ms(lambda: stages.blend_everywhere(native.instructions, PEAK_ROUNDS))
        peaks.append(stages.blend_everywhere(native.instructions, 1) * PEAK_ROUNDS / peak_ms)
        if peaks[-1] > 0:
            fractions.append(lanes.processed / blend_ms / peaks[-1])
        if round_ < SCALAR_REPEATS:
            ratios.append(_cpu_ms(lambda: stages.blend("scalar")) / blend_ms)
    rows = [at_least("raster.blend_vs_scalar", float(np.median(ratios)), "x", bar=SCALAR_BAR)]
    if not fractions:
        print("bench raster: left out blend_vs_peak: no vector instructions", file=sys.stderr)
        return rows
    low, median, high = (float(q) for q in np.percentile(fractions, [25, 50, 75]))
    spread = high - low
    useful = lanes.useful / lanes.processed
    return [
        *rows,
        at_least("raster.blend_vs_peak", median, "", bar=PEAK_BAR, spread=spread),
        Row("raster.blend_vs_peak.useful", median * useful, "", spread=spread * useful),
        Row("raster.blend_peak", float(np.median(peaks)) / 1e3, "M/s"),
    ]


def _split(
    native: NativeRenderer, objects: Sequence[PosedSplats], views: Sequence[View], repeats: int
) -> _Split:
    options = RenderOptions(threads=1)
    stages = tuple(stages_of(native, objects, camera, pose, options) for camera, pose in views)
    times_ms: dict[str, list[float]] = {stage: [] for stage in STAGES}
    for _ in range(1 + repeats):
        works: dict[str, Callable[[Stages], object]] = {
            "project": Stages.project,
            "sort": Stages.sort,
            "bin": Stages.bin,
            "blend": lambda view: view.blend(native.instructions),
        }
        for stage, work in works.items():
            spent = sum(_cpu_ms(lambda work=work, view=view: work(view)) for view in stages)
            times_ms[stage].append(spent)
    # The first round also gets its memory from the system.
    return _Split(stages, {stage: times[1:] for stage, times in times_ms.items()})


def _lanes(split: _Split, instructions: str) -> LaneCount:
    counts = [stages.count_lanes(instructions) for stages in split.stages]
    return LaneCount(sum(c.useful for c in counts), sum(c.processed for c in counts))


def _cpu_ms(work: Callable[[], object]) -> float:
    start = time.process_time_ns()
    work()
    return (time.process_time_ns() - start) / 1e6
