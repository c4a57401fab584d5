"""A camera's clock on the session's: the offset is that of the packet which came fastest."""

from __future__ import annotations

WINDOW_NS = 30_000_000_000
"""How far back the fastest packet is looked for. Two crystals 100 ppm apart drift 3 ms in it."""


class CameraTime:
    """Estimates capture times from the camera's time stamps and their arrival.

    The smallest difference of arrival and time stamp of the last `WINDOW_NS` or two is taken for
    the offset of the two clocks. What the fastest packet itself needed stays in it: times are late
    by that much, and they never lie after the arrival.
    """

    def __init__(self) -> None:
        self._began_ns: int | None = None
        self._least_ns = 0
        self._least_before_ns: int | None = None
        self._given_ns = -1

    def session_ns(self, t_us: int, received_ns: int) -> int:
        """Capture time on the session's clock; grows from call to call.

        Args:
            t_us: microseconds on the camera's clock.
            received_ns: when it arrived, on the session's clock.
        """
        offset_ns = received_ns - 1000 * t_us
        if self._began_ns is None:
            self._began_ns, self._least_ns = received_ns, offset_ns
        elif received_ns - self._began_ns > WINDOW_NS:
            self._least_before_ns = self._least_ns
            self._began_ns, self._least_ns = received_ns, offset_ns
        self._least_ns = min(self._least_ns, offset_ns)
        least_ns = self._least_ns
        if self._least_before_ns is not None:
            least_ns = min(least_ns, self._least_before_ns)
        self._given_ns = max(1000 * t_us + least_ns, self._given_ns + 1)
        return self._given_ns
