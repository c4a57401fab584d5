"""A camera's clock on the session's: its unit is measured, then it is mapped by what comes fastest.

Published descriptions disagree on the unit of the time stamps: microseconds or milliseconds. So it
is measured from the stream itself; until then, and where stamps do not run, times are those of
arrival.
"""

from __future__ import annotations

import math

from devices.clock_mapping import ClockEstimate, ClockMapping, add_arrival, estimate

LEARN_NS = 300_000_000
"""Time over which ticks are counted. Units differ by 1000, so a ratio off by 30 still decides."""

_UNITS_NS = (1, 1_000, 1_000_000)
"""Units that stamps of cameras have: nanoseconds, microseconds, milliseconds."""
_FARTHEST = 30.0
"""Ratio of the measured unit to a known one beyond which it is neither."""


class CameraTime:
    """Estimates capture times from the camera's time stamps and their arrival.

    The two clocks are mapped by `devices.clock_mapping`. What the fastest packet itself needed
    stays in the times: they are late by that much, and they never lie after the arrival.
    """

    def __init__(self) -> None:
        self._first: tuple[int, int] | None = None
        self._tick_ns: int | None = None
        self._mapping = ClockMapping()
        self._given_ns = -1

    @property
    def tick_ns(self) -> int | None:
        """Unit of the camera's time stamps, nanoseconds; None while it is not known."""
        return self._tick_ns

    @property
    def estimate(self) -> ClockEstimate | None:
        """The camera's clock in nanoseconds against the session's; None while it is not known."""
        return estimate(self._mapping)

    def session_ns(self, stamp: int, received_ns: int) -> int:
        """Capture time on the session's clock; grows from call to call.

        Args:
            stamp: time on the camera's clock, in its own unit.
            received_ns: when it arrived, on the session's clock.
        """
        if self._tick_ns is None:
            self._learn(stamp, received_ns)
        time_ns = received_ns
        if self._tick_ns is not None:
            device_ns = stamp * self._tick_ns
            self._mapping = add_arrival(self._mapping, device_ns, received_ns)
            known = estimate(self._mapping)
            if known is not None:
                time_ns = min(received_ns, known.session_ns(device_ns))
        self._given_ns = max(time_ns, self._given_ns + 1)
        return self._given_ns

    def _learn(self, stamp: int, received_ns: int) -> None:
        """Learn the unit of the stamps, once enough of them came."""
        if self._first is None or stamp < self._first[0]:
            self._first = (stamp, received_ns)
            return
        ticks, elapsed_ns = stamp - self._first[0], received_ns - self._first[1]
        if ticks == 0 or elapsed_ns < LEARN_NS:
            return
        ratio = elapsed_ns / ticks
        unit_ns = min(_UNITS_NS, key=lambda unit: abs(math.log(ratio / unit)))
        if 1 / _FARTHEST < ratio / unit_ns < _FARTHEST:
            self._tick_ns = unit_ns
        else:
            self._first = (stamp, received_ns)
