"""Limits on how often: a bucket of tokens that refills with time."""

from __future__ import annotations

SAY_HZ, SAY_BURST = 2.0, 30.0
"""Lines about refusals in the log: an attack does not fill it; counts go on."""


class Bucket:
    """A bucket that holds at most `burst` tokens and gets `rate_hz` a second.

    Args:
        rate_hz: tokens a second.
        burst: tokens it holds, which it has at first.
        now_ns: session time.
    """

    def __init__(self, rate_hz: float, burst: float, *, now_ns: int) -> None:
        self._rate_hz, self._burst = rate_hz, burst
        self._tokens = burst
        self._filled_ns = now_ns

    def take(self, now_ns: int, tokens: float = 1.0) -> bool:
        """Take tokens; return whether there were enough, and leave them where there were not."""
        since_ns = max(0, now_ns - self._filled_ns)
        self._tokens = min(self._burst, self._tokens + since_ns * 1e-9 * self._rate_hz)
        self._filled_ns = max(now_ns, self._filled_ns)
        if self._tokens < tokens:
            return False
        self._tokens -= tokens
        return True


def refusal_lines(now_ns: int) -> Bucket:
    """Return a limit of lines about refusals."""
    return Bucket(SAY_HZ, SAY_BURST, now_ns=now_ns)
