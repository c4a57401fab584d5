"""A device's clock on the session's clock: offset and drift, each with its uncertainty.

Pure: states go in and come out, of bounded size; times are handed in. Two kinds of evidence:

- Round trips, where the device can be asked for its time. The answer was made between sending and
  receiving, so every round trip bounds the offset by ± RTT/2 whatever the ways took. The estimate
  is the middle of all offsets and drifts that keep within every bound.
- Arrivals, where a device only sends stamps. What came fastest in every second lies on a line; its
  slope is the drift. The offset has the constant part of the way in it, which nothing shows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

BIN_NS = 1_000_000_000
"""Of every such stretch of session time the fastest sample is kept, nanoseconds: 30 pictures."""

MAX_BINS = 64
"""Stretches that are kept: what a device's clock did a minute ago is forgotten. Drift of stamps
with 0.5 ms of spread is known to 4 ppm then (spread over the root of the sum of squared times)."""

MAX_DRIFT_PPM = 500.0
"""Largest drift that is believed: crystals of cameras are within 100 ppm, of phones within 50."""

JUMP_NS = 2_000_000_000
"""Change of the offset at which a device's clock has been set anew, or the device has started
again; what a network holds back longer than this is rather a new connection."""

EARLY_NS = 100_000_000
"""An arrival that much before the line says that the clock was set, nanoseconds: no way has become
that much faster than the fastest of a second."""

MIN_BINS = 4
"""Stretches from which a drift is taken; before, it is any within `MAX_DRIFT_PPM`."""

OUTLIER = 6.0
"""Residuals over their median size that are counted in full: 4 standard deviations if they were
normal; of the fastest of 30 exponential delays 1 in 80 is farther."""

FEW = 2.4
"""By how much a spread of few residuals is enlarged, over their degrees of freedom: from Student's
to normal quantiles at 95 % (2.2 for 2, where 2.4 / 2 gives 2.2; less for more)."""

EFFICIENCY = 0.9
"""Variance of a least-squares slope over that of the median of slopes, normal residuals (Sen: 0.95
for evenly spaced times, less for few)."""

_UNIFORM = math.sqrt(3.0)
"""Half width of a uniform distribution over its standard deviation."""


@dataclass(frozen=True, slots=True)
class ClockEstimate:
    """Estimate of a device's clock.

    Attributes:
        device_ns: the device's time at which the offset holds.
        offset_ns: session time minus device time then; where `is_one_way`, the shortest time that a
            message needs is in it.
        drift_ppm: by how much the offset grows; a device whose clock is slow has a positive one.
        offset_sigma_ns: standard deviation of the offset; where `is_one_way`, without the constant
            part of the way.
        drift_sigma_ppm: of the drift.
        is_one_way: whether it comes from arrivals alone.
    """

    device_ns: int
    offset_ns: int
    drift_ppm: float
    offset_sigma_ns: float
    drift_sigma_ppm: float
    is_one_way: bool

    def session_ns(self, device_ns: int) -> int:
        """Session time of an instant of the device's clock."""
        elapsed_ns = device_ns - self.device_ns
        return device_ns + self.offset_ns + round(elapsed_ns * self.drift_ppm * 1e-6)

    def sigma_ns(self, device_ns: int) -> float:
        """Standard deviation of `session_ns`."""
        elapsed_ns = device_ns - self.device_ns
        return math.hypot(self.offset_sigma_ns, elapsed_ns * self.drift_sigma_ppm * 1e-6)


@dataclass(frozen=True, slots=True)
class _Bin:
    """The fastest sample of a stretch: the offset lies between `low_ns` and `high_ns`."""

    number: int
    device_ns: int
    low_ns: int
    high_ns: int
    count: int


@dataclass(frozen=True, slots=True)
class ClockMapping:
    """Observations of one device's clock; begin with `ClockMapping()`.

    Attributes:
        trips: the fastest round trips, at most `MAX_BINS`.
        arrivals: the fastest arrivals, likewise; `high_ns` is arrival minus stamp.
        restarts: how often the device's clock was found set anew.
    """

    trips: tuple[_Bin, ...] = ()
    arrivals: tuple[_Bin, ...] = ()
    restarts: int = 0


def add_round_trip(
    mapping: ClockMapping, sent_ns: int, device_ns: int, received_ns: int
) -> ClockMapping:
    """With one answer of the device.

    Args:
        mapping: what was seen before.
        sent_ns: when it was asked, session time.
        device_ns: what it answered.
        received_ns: when the answer came.

    Raises:
        ValueError: it came before it was asked for.
    """
    if received_ns < sent_ns:
        raise ValueError(f"round trip: received at {received_ns} ns, sent at {sent_ns} ns")
    new = _Bin(
        received_ns // BIN_NS, device_ns, sent_ns - device_ns, received_ns - device_ns, count=1
    )
    trips = mapping.trips
    if trips and _is_apart(trips[-1], new):
        return ClockMapping((new,), restarts=mapping.restarts + 1)
    if trips and trips[-1].number == new.number:
        last = trips[-1]
        best = min(last, new, key=lambda trip: trip.high_ns - trip.low_ns)
        trips = (*trips[:-1], replace(best, count=last.count + 1))
    else:
        trips = (*trips, new)
    return replace(mapping, trips=_consistent(trips[-MAX_BINS:]))


def add_arrival(mapping: ClockMapping, device_ns: int, received_ns: int) -> ClockMapping:
    """With one message of the device: its stamp, and when it came on the session's clock."""
    offset_ns = received_ns - device_ns
    new = _Bin(received_ns // BIN_NS, device_ns, offset_ns, offset_ns, count=1)
    arrivals = mapping.arrivals
    if not arrivals:
        return replace(mapping, arrivals=(new,))
    last = arrivals[-1]
    fastest_ns = min(arrival.high_ns for arrival in arrivals)
    if offset_ns > last.high_ns + JUMP_NS or offset_ns < fastest_ns - EARLY_NS:
        return ClockMapping(arrivals=(new,), restarts=mapping.restarts + 1)
    if last.number == new.number:
        best = min(last, new, key=lambda arrival: arrival.high_ns)
        arrivals = (*arrivals[:-1], replace(best, count=last.count + 1))
    else:
        arrivals = (*arrivals, new)
    return replace(mapping, arrivals=arrivals[-MAX_BINS:])


def estimate(mapping: ClockMapping) -> ClockEstimate | None:
    """Offset and drift, from round trips where there are any; None before the first sample."""
    if mapping.trips:
        return _estimate_from_trips(mapping.trips)
    if mapping.arrivals:
        return _estimate_from_arrivals(mapping.arrivals)
    return None


def _is_apart(last: _Bin, new: _Bin) -> bool:
    """Whether the two cannot be of one clock, even if it drifts."""
    room_ns = abs(new.device_ns - last.device_ns) * MAX_DRIFT_PPM * 1e-6
    gap_ns = max(new.low_ns - last.high_ns, last.low_ns - new.high_ns)
    return gap_ns > room_ns


Floats = NDArray[np.float64]


def _columns(bins: tuple[_Bin, ...]) -> tuple[Floats, Floats, Floats]:
    """Seconds and nanoseconds after the last bin's: time, low, high."""
    last = bins[-1]
    return (
        np.array([(b.device_ns - last.device_ns) * 1e-9 for b in bins]),
        np.array([float(b.low_ns - last.low_ns) for b in bins]),
        np.array([float(b.high_ns - last.low_ns) for b in bins]),
    )


def _drift_range(t_s: Floats, low_ns: Floats, high_ns: Floats) -> tuple[float, float]:
    """Drifts in ns/s (1000 ns/s are 1 ppm) of lines between all bounds; empty if low > high."""
    most = MAX_DRIFT_PPM * 1e3
    apart_s = t_s[:, None] - t_s[None, :]
    room_ns = high_ns[:, None] - low_ns[None, :]
    later, earlier = apart_s > 0, apart_s < 0
    upper = np.min(room_ns[later] / apart_s[later], initial=most)
    lower = np.max(room_ns[earlier] / apart_s[earlier], initial=-most)
    return float(lower), float(upper)


def _consistent(trips: tuple[_Bin, ...]) -> tuple[_Bin, ...]:
    """The newest trips that one line passes: the older ones go where a drift has changed."""
    while len(trips) > 1:
        lower, upper = _drift_range(*_columns(trips))
        if lower <= upper:
            return trips
        trips = trips[1:]
    return trips


def _estimate_from_trips(trips: tuple[_Bin, ...]) -> ClockEstimate:
    """The middle of all lines between the bounds, at the last trip."""
    t_s, low_ns, high_ns = _columns(trips)
    lower, upper = _drift_range(t_s, low_ns, high_ns)
    drifts = np.linspace(lower, upper, 257)[:, None]
    # For a drift, the offsets at the last trip are between the highest low and the lowest high.
    lows = np.max(low_ns - drifts * t_s, axis=1)
    highs = np.min(high_ns - drifts * t_s, axis=1)
    least, greatest = float(np.min(lows)), float(np.max(highs))
    last = trips[-1]
    return ClockEstimate(
        last.device_ns,
        last.low_ns + round((least + greatest) / 2),
        (lower + upper) / 2e3,
        max((greatest - least) / 2 / _UNIFORM, 1.0),
        (upper - lower) / 2e3 / _UNIFORM,
        is_one_way=False,
    )


def _estimate_from_arrivals(arrivals: tuple[_Bin, ...]) -> ClockEstimate:
    """A robust line through the fastest arrivals, moved down to the fastest of all."""
    last = arrivals[-1]
    usual = float(np.median([arrival.count for arrival in arrivals]))
    # The fastest of few is slower than the fastest of many: the bin that has just begun is left.
    full = tuple(arrival for arrival in arrivals if arrival.count >= usual / 2)
    if len(full) < MIN_BINS:
        fastest = min(arrivals, key=lambda arrival: arrival.high_ns)
        spread_ns = max(arrival.high_ns for arrival in arrivals) - fastest.high_ns
        elapsed_ns = last.device_ns - fastest.device_ns
        sigma_ppm = MAX_DRIFT_PPM / _UNIFORM
        sigma_ns = math.hypot(max(spread_ns, 1), elapsed_ns * sigma_ppm * 1e-6)
        return ClockEstimate(
            last.device_ns, fastest.high_ns, 0.0, sigma_ns, sigma_ppm, is_one_way=True
        )
    t_s, _, offset_ns = _columns((*full, last))
    t_s, offset_ns = t_s[:-1], offset_ns[:-1]
    slope, level = _robust_line(t_s, offset_ns)
    residuals = offset_ns - level - slope * t_s
    count = len(full)
    # What is far beyond the usual is congestion, and counts as if it were not as far.
    usual_ns = float(np.median(np.abs(residuals)))
    near = np.clip(residuals, -OUTLIER * usual_ns, OUTLIER * usual_ns)
    freedom = count - 2
    spread_ns = math.sqrt(float(np.sum(near**2)) / freedom) * (1 + FEW / freedom)
    spread_ns = max(spread_ns, 1.0)
    centre_s = float(np.mean(t_s))
    squares = float(np.sum((t_s - centre_s) ** 2))
    lowest_ns = level + float(np.min(residuals))
    return ClockEstimate(
        last.device_ns,
        last.low_ns + round(lowest_ns),
        slope / 1e3,
        spread_ns * math.sqrt(1 + 1 / count + centre_s**2 / squares),
        spread_ns / math.sqrt(EFFICIENCY * squares) / 1e3,
        is_one_way=True,
    )


def _robust_line(t_s: Floats, offset_ns: Floats) -> tuple[float, float]:
    """Median of the slopes of all pairs (Theil, Sen), in ns/s; and the median level at 0."""
    first, second = np.triu_indices(len(t_s), 1)
    apart_s = t_s[second] - t_s[first]
    moved = apart_s > 0
    slopes = (offset_ns[second] - offset_ns[first])[moved] / apart_s[moved]
    most = MAX_DRIFT_PPM * 1e3
    slope = float(np.clip(np.median(slopes), -most, most)) if len(slopes) else 0.0
    return slope, float(np.median(offset_ns - slope * t_s))
