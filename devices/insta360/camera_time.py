"""A camera's clock on the session's: its unit is measured, its offset is the fastest packet's.

Published descriptions disagree on the unit of the time stamps: microseconds or milliseconds. So it
is measured from the stream itself; until then, and where stamps do not run, times are those of
arrival.
"""

from __future__ import annotations

import math

WINDOW_NS = 30_000_000_000
"""How far back the fastest packet is looked for. Two crystals 100 ppm apart drift 3 ms in it."""

LEARN_NS = 300_000_000
"""Time over which ticks are counted. Units differ by 1000, so a ratio off by 30 still decides."""

JUMP_NS = 5_000_000_000
"""Change of the offset at which the camera's clock is taken to have been set anew."""

_UNITS_NS = (1, 1_000, 1_000_000)
_FARTHEST = 30.0


class CameraTime:
    """Estimates capture times from the camera's time stamps and their arrival.

    The smallest difference of arrival and time stamp of the last `WINDOW_NS` or two is taken for
    the offset of the two clocks. What the fastest packet itself needed stays in it: times are late
    by that much, and they never lie after the arrival.
    """

    def __init__(self) -> None:
        self._first: tuple[int, int] | None = None
        self._tick_ns: int | None = None
        self._began_ns = 0
        self._least_ns = 0
        self._least_before_ns: int | None = None
        self._given_ns = -1

    @property
    def tick_ns(self) -> int | None:
        """Unit of the camera's time stamps, nanoseconds; None while it is not known."""
        return self._tick_ns

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
            time_ns = stamp * self._tick_ns + self._offset_ns(
                received_ns - stamp * self._tick_ns, received_ns
            )
        self._given_ns = max(time_ns, self._given_ns + 1)
        return self._given_ns

    def _learn(self, stamp: int, received_ns: int) -> None:
        """Which unit the stamps have, once enough of them came."""
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
            self._restart(received_ns - stamp * unit_ns, received_ns)
        else:
            self._first = (stamp, received_ns)

    def _restart(self, offset_ns: int, received_ns: int) -> None:
        self._began_ns, self._least_ns, self._least_before_ns = received_ns, offset_ns, None

    def _offset_ns(self, offset_ns: int, received_ns: int) -> int:
        """Smallest offset of this window and the one before, this packet's included."""
        if abs(offset_ns - self._least_ns) > JUMP_NS:
            self._restart(offset_ns, received_ns)
        elif received_ns - self._began_ns > WINDOW_NS:
            before_ns = self._least_ns
            self._restart(offset_ns, received_ns)
            self._least_before_ns = before_ns
        self._least_ns = min(self._least_ns, offset_ns)
        if self._least_before_ns is None:
            return self._least_ns
        return min(self._least_ns, self._least_before_ns)
