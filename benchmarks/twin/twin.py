"""`nexus bench twin`: the figures of the digital twin, from its camera to its forks.

The camera's is a rehearsal of the default scenario with nobody watching: physics, people, drawing,
sensor, and H.264 there and back.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.twin import physics
from benchmarks.twin.forks import INSTANTS_S, measure_forks
from scenes.samples import sample_room
from sim.rehearsal import SimulatedStep, simulate
from sim.scenarios.scenario import DEFAULT_SCENARIOS, Scenario, load_scenario
from studio.console.rows import Row, as_json, as_table, at_least, at_most, exit_code

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

ROOM = "lab"

SEED = 0

FPS_BAR = 10.0
"""Frames a second that the camera has to deliver: those of the scenario's clock."""

WARM_UP_FRAMES = 10
"""Frames before the first stretch: the first ones are drawn whole, and nothing is encoded yet."""

STRETCHES = 5

STRETCH_FRAMES = 20


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


@dataclass(frozen=True, slots=True)
class Stretch:
    """Times of a stretch of frames.

    Attributes:
        fps: frames a second, by the clock on the wall.
        cpu_ms: processor time of all threads, for one frame.
    """

    fps: float
    cpu_ms: float


def measure_camera(
    scenario: Scenario | None = None,
    *,
    stretches: int = STRETCHES,
    frames: int = STRETCH_FRAMES,
    warm_up: int = WARM_UP_FRAMES,
) -> list[Row]:
    """`twin.camera_fps` and `twin.camera_cpu_ms`: medians over several stretches of a rehearsal.

    Args:
        scenario: of the lab; the default one if None.
        stretches: how many are measured, one after another.
        frames: in a stretch.
        warm_up: frames before the first stretch.

    Raises:
        ValueError: the scenario ends before the last stretch does.
    """
    scenario = scenario or load_scenario(DEFAULT_SCENARIOS[ROOM])
    wanted = warm_up + stretches * frames
    if scenario.frame_count < wanted:
        raise ValueError(
            f"scenario {scenario.name}: {scenario.frame_count} frames, wanted at least {wanted} "
            f"to measure {stretches} stretches; play a longer one"
        )
    # No frame may be missing, or a stretch would be longer than it seems.
    whole = replace(scenario, faults=type(scenario.faults)())
    steps = simulate(sample_room(ROOM), whole, seed=SEED)
    for _ in range(warm_up):
        next(steps)
    measured = [_stretch(steps, frames) for _ in range(stretches)]
    fps = np.array([stretch.fps for stretch in measured])
    cpu_ms = np.array([stretch.cpu_ms for stretch in measured])
    return [
        at_least(
            "twin.camera_fps", float(np.median(fps)), "1/s", bar=FPS_BAR, spread=_quartiles(fps)
        ),
        at_most("twin.camera_cpu_ms", float(np.median(cpu_ms)), "ms", spread=_quartiles(cpu_ms)),
    ]


def _stretch(steps: Iterator[SimulatedStep], frames: int) -> Stretch:
    begun_s, busy_s = time.perf_counter(), time.process_time()
    for _ in range(frames):
        next(steps)
    took_s, worked_s = time.perf_counter() - begun_s, time.process_time() - busy_s
    return Stretch(frames / took_s, 1e3 * worked_s / frames)


def _quartiles(values: NDArray[np.float64]) -> float:
    low, high = np.quantile(values, (0.25, 0.75))
    return float(high - low)
