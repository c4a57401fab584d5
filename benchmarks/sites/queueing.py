"""Waiting at a machine that serves messages one after the other, as they come."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_MESSAGES = 4_000_000
"""Messages that are simulated at a time, 32 MB of times."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """Times at a machine.

    Attributes:
        utilisation: share of the time in which it works; 1 or more: it falls behind for ever.
        wait_ms: percentiles 50, 95, 99 of the time before a message is served.
    """

    utilisation: float
    wait_ms: tuple[float, float, float]


def periodic_arrivals(
    sources: int, hz: float, *, seconds: float, generator: np.random.Generator
) -> NDArray[np.float64]:
    """Return when messages come from sources that send at one rate, each at a phase of its own.

    Every message is late by up to a tenth of the period, as programs' timers are.

    Args:
        sources: how many.
        hz: messages a second of each.
        seconds: how long.
        generator: of phases and lateness.

    Raises:
        ValueError: that many are not simulated.
    """
    each = max(1, round(hz * seconds))
    if sources * each > MAX_MESSAGES:
        raise ValueError(f"{sources * each} messages, at most {MAX_MESSAGES}; simulate less time")
    phases = generator.uniform(0.0, 1.0, (sources, 1))
    late = generator.uniform(0.0, 0.1, (sources, each))
    times = (phases + late + np.arange(each)) / hz
    return np.sort(times, axis=None)


def waiting_times(
    arrivals_s: NDArray[np.float64], services_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how long each message waits until it is served, seconds (Lindley's recursion).

    Args:
        arrivals_s: (N,) times, in order.
        services_s: (N,) time that each takes.
    """
    gaps = np.diff(arrivals_s)
    steps = np.concatenate(([0.0], np.cumsum(services_s[:-1] - gaps)))
    return steps - np.minimum.accumulate(steps)


def wait_at(
    arrivals_s: NDArray[np.float64], service_s: float, *, generator: np.random.Generator
) -> Waiting:
    """Return how messages wait whose service takes an exponential time, as a program's does.

    Args:
        arrivals_s: (N,) times, in order.
        service_s: mean time of service: of a machine with n cores, an nth of one core's.
        generator: of the times of service.
    """
    services = generator.exponential(service_s, len(arrivals_s))
    waits = 1000.0 * waiting_times(arrivals_s, services)
    span_s = max(float(arrivals_s[-1] - arrivals_s[0]), 1e-9)
    p50, p95, p99 = np.percentile(waits, (50, 95, 99))
    return Waiting(len(arrivals_s) * service_s / span_s, (float(p50), float(p95), float(p99)))
