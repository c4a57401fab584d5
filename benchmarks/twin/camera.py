"""How many frames a second the simulated 360° camera delivers, everything that makes one included.

That is a rehearsal of the default scenario with nobody watching: physics, people, drawing, sensor,
and H.264 there and back.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.samples import sample_room
from sim.rehearsal import SimulatedStep, simulate
from sim.scenarios.scenario import DEFAULT_SCENARIOS, Scenario, load_scenario
from studio.console.rows import Row, at_least, at_most

ROOM = "lab"
SEED = 0
FPS_BAR = 10.0
"""Frames a second that the camera has to deliver: those of the scenario's clock."""
WARM_UP_FRAMES = 10
"""Frames before the first stretch: the first ones are drawn whole, and nothing is encoded yet."""
STRETCHES = 5
STRETCH_FRAMES = 20


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
