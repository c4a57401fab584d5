"""A simulated HoloLens in a process of its own, and how late what it senses gets to consumers."""

from __future__ import annotations

import json
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from devices.clock import WallClock
from devices.hololens.headset import Headset
from devices.hololens.plan import HeadsetPlan, Ports, VideoOptions
from devices.hololens.values import HeadsetStatus, StreamName
from devices.hololens.wire.packets import TICK_NS
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.task import Task
from sim.hololens.drawing.time_code import burnt_us
from sim.hololens.world import BOOTED_NS

START_S = 60.0
"""Longest wait for the simulator, seconds: the first time a room's pictures are drawn."""

WARM_S = 3.0
"""Seconds after the first picture in which nothing is counted."""

CLOCK_S = 10.0
"""Time after which the clock's error is measured, seconds."""

CLOCK_CHECKS, CLOCK_CHECK_S = 20, 0.1
"""Errors of the clock that are taken, and seconds between them."""

MAX_DELAYS = 200_000
"""Delays that are kept of each stream: an hour of hands."""


class SimulatorError(RuntimeError):
    """The simulator did not begin; its last words."""


class SimulatorProcess:
    """`nexus simulate hololens` in a process of its own.

    Args:
        words: further flags.

    Raises:
        SimulatorError: it does not begin.
    """

    def __init__(self, *words: str) -> None:
        self._started = threading.Event()
        self._about: dict[str, Any] = {}
        command = ("simulate", "hololens", "lab", "--any-ports", "--json", *words)
        self._process = ChildProcess(
            module_command("studio.cli", *command),
            on_line=self._hear,
            last_words=20,
            environment=module_environment(),
        )
        if not self._started.wait(START_S) or not self._about:
            self.close()
            raise SimulatorError(f"the simulator did not begin: {self._process.last_words()}")

    @property
    def ports(self) -> Ports:
        """Ports that it listens at."""
        return Ports(**self._about["ports"])

    def ticks_at(self, glass_ns: int) -> int:
        """Return the headset's own time at a time of this machine's clock."""
        since_ns = glass_ns - int(self._about["began_glass_ns"])
        drift_ppm = float(self._about["drift_ppm"])
        return (BOOTED_NS + since_ns + round(since_ns * drift_ppm * 1e-6)) // TICK_NS

    def close(self) -> None:
        """End it."""
        self._process.end(5.0)

    def _hear(self, line: str) -> None:
        said = json.loads(line)
        if said.get("event") == "started":
            self._about = said
        self._started.set()


@dataclass(frozen=True, slots=True)
class HeadsetFigures:
    """How late it came.

    Attributes:
        video_ms: from the burnt time to a consumer, each picture.
        hands_ms: from being sensed to a consumer, each sample.
        seconds: in which they were counted.
        status: of the headset at the end.
    """

    video_ms: list[float]
    hands_ms: list[float]
    seconds: float
    status: HeadsetStatus


def measure_streams(seconds: float, *, seed: int, video: VideoOptions) -> HeadsetFigures:
    """Return how late pictures and hands come over loopback, everything switched on."""
    simulator = SimulatorProcess("--time-code", "--seed", str(seed))
    clock = WallClock()
    headset = Headset(HeadsetPlan("127.0.0.1", simulator.ports, video=video), clock)
    video_ms: deque[float] = deque(maxlen=MAX_DELAYS)
    hands_ms: deque[float] = deque(maxlen=MAX_DELAYS)
    pictures, samples = headset.video(), headset.body()

    def look(task: Task[None]) -> None:
        while not task.is_cancelled:
            frame = pictures.take(0.2)
            if frame is not None:
                now_us = time.perf_counter_ns() // 1000
                burnt = burnt_us(frame.picture.y)
                if burnt is not None:
                    video_ms.append((now_us - burnt) / 1e3)

    def feel(task: Task[None]) -> None:
        while not task.is_cancelled:
            sample = samples.take(0.2)
            if sample is not None:
                hands_ms.append((clock.now_ns() - sample.t_ns) / 1e6)

    tasks = [Task("pictures", look).start(), Task("hands", feel).start()]
    try:
        until = time.monotonic() + START_S
        while not video_ms and time.monotonic() < until:
            time.sleep(0.1)
        time.sleep(WARM_S)
        video_ms.clear()
        hands_ms.clear()
        time.sleep(seconds)
        return HeadsetFigures(list(video_ms), list(hands_ms), seconds, headset.status())
    finally:
        for task in tasks:
            task.cancel()
            task.join(1.0)
        headset.close()
        simulator.close()


def measure_clock(*, seed: int, jitter_s: float, drift_ppm: float) -> list[float]:
    """Return errors of the headset's clock, ms, after `CLOCK_S` of round trips."""
    faults = (f"jitter:size={jitter_s}", f"drift:size={drift_ppm}")
    words = [word for fault in faults for word in ("--fault", fault)]
    simulator = SimulatorProcess("--seed", str(seed), *words)
    clock = WallClock()
    plan = HeadsetPlan("127.0.0.1", simulator.ports, streams=frozenset({StreamName.CLOCK}))
    headset = Headset(plan, clock)
    try:
        time.sleep(CLOCK_S)
        errors: list[float] = []
        for _ in range(CLOCK_CHECKS):
            before_ns = clock.now_ns()
            ticks = simulator.ticks_at(time.perf_counter_ns())
            true_ns = (before_ns + clock.now_ns()) // 2
            found_ns = headset.session_ns(ticks)
            errors.append(float("inf") if found_ns is None else (found_ns - true_ns) / 1e6)
            time.sleep(CLOCK_CHECK_S)
        return errors
    finally:
        headset.close()
        simulator.close()


def worst(errors_ms: list[float]) -> float:
    """Return the largest error without its sign."""
    return float(np.max(np.abs(errors_ms)))
