"""The hub with a crowd in it: latency, processor time, memory."""

from __future__ import annotations

import json
import subprocess
import time
from array import array
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from benchmarks.wire.attack_hub import resident_bytes
from benchmarks.wire.crowd import ASK, CrowdFigures, Orders
from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.server import Hub
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState
from scenes.workers.child_process import ChildProcess, module_command, module_environment

PUBLISH_HZ = 30.0
"""States a second: the tracker's."""

OBJECTS = 12
"""Objects of a state, all of which move: as many as the lab has."""

BEGIN_SHARE, END_SHARE = 0.2, 0.8
"""Parts of the run before which, and after which, memory is averaged for its growth."""

PATIENCE_S = 30.0
"""Time that a crowd may take beyond its orders: to start, to come in, to reckon."""


@dataclass(frozen=True, slots=True)
class LoadFigures:
    """How a hub stood a crowd.

    Attributes:
        crowd: what its people saw.
        cpu_percent: processor time of this process, with its publishing and taking, in percent of
            one core.
        growth_percent: memory at the end beyond that after the beginning.
        publish_ms: percentiles 50 and 99 of a call of `publish`.
        take_ms: the same of `take`.
        sent_bytes: of the hub.
        dropped: states and bodies that newer ones replaced.
        refused: of all kinds.
    """

    crowd: CrowdFigures
    cpu_percent: float
    growth_percent: float
    publish_ms: tuple[float, float]
    take_ms: tuple[float, float]
    sent_bytes: int
    dropped: int
    refused: int


def load_hub(clients: int, *, hz: float, seconds: float) -> LoadFigures:
    """Return how a hub on loopback stands that many people, who are in a process of their own.

    Raises:
        OSError: the crowd has failed.
    """
    hub = Hub(HubSettings(max_people=clients), {}, clock=WallClock())
    hub.start()
    lines: list[str] = []

    def hear(line: str) -> None:
        if line == ASK:
            crowd.say(hub.invite().code)
        else:
            lines.append(line)

    crowd = ChildProcess(
        module_command("benchmarks.wire.crowd"),
        stdin=subprocess.PIPE,
        on_line=hear,
        last_words=20,
        environment=module_environment(),
    )
    try:
        crowd.say(json.dumps(asdict(Orders(hub.url, clients, hz, seconds))))
        while len(hub.people()) < clients and crowd.is_running:
            time.sleep(0.05)
        measured = _drive(hub, crowd, limit_s=seconds + PATIENCE_S)
        if measured is None or not lines:
            raise OSError(f"the crowd has failed: {' '.join(crowd.last_words()[-3:])}")
        counts = hub.counts()
        figures = CrowdFigures(**json.loads(lines[-1]))
        refused = sum(counts.refused.values())
        return LoadFigures(figures, *measured, counts.sent_bytes, counts.dropped, refused)
    finally:
        crowd.end()
        hub.close()


def _drive(
    hub: Hub, crowd: ChildProcess, *, limit_s: float
) -> tuple[float, float, tuple[float, float], tuple[float, float]] | None:
    """Publish and take until the crowd has gone; return processor share, growth, and both times.

    None where nobody was ever connected.
    """
    publish_ms, take_ms, memory = array("f"), array("f"), array("d")  # small: memory is measured
    begin_s, begin_cpu_s = time.perf_counter(), time.process_time()
    end_s, end_cpu_s = begin_s, begin_cpu_s
    step = 0
    while crowd.is_running and time.perf_counter() - begin_s < limit_s:
        step += 1
        state = _state(step)
        before_s = time.perf_counter()
        hub.publish(state)
        between_s = time.perf_counter()
        hub.take()
        after_s = time.perf_counter()
        publish_ms.append(1000 * (between_s - before_s))
        take_ms.append(1000 * (after_s - between_s))
        if any(person.is_connected for person in hub.people()):
            memory.append(resident_bytes())
            end_s, end_cpu_s = time.perf_counter(), time.process_time()
        time.sleep(max(0.0, begin_s + step / PUBLISH_HZ - time.perf_counter()))
    if not memory:
        return None
    early = np.mean(memory[int(BEGIN_SHARE * len(memory)) :][:30])
    late = np.mean(memory[int(END_SHARE * len(memory)) :])
    return (
        100 * (end_cpu_s - begin_cpu_s) / max(end_s - begin_s, 1e-9),
        100 * float(late / early - 1),
        _shares(publish_ms),
        _shares(take_ms),
    )


def _shares(values: Sequence[float]) -> tuple[float, float]:
    middle, high = np.percentile(values, (50, 99))
    return float(middle), float(high)


def _state(step: int) -> SceneState:
    """Return a state in which every object moves."""
    objects = {
        f"object {number}": TrackedObject(
            f"object {number}",
            step,
            Pose.from_yaw(0.01 * step, (number, 0.001 * step, 0)),
            np.eye(4),
            1.0,
            TrackState.TRACKED,
            0.9,
            step,
        )
        for number in range(OBJECTS)
    }
    return SceneState(step, step, objects)
