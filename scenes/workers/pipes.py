"""Pipes between processes, wide enough for a picture."""

from __future__ import annotations

import sys
from contextlib import suppress

PIPE_BYTES = 1 << 20
"""Size that is asked for: the most that Linux gives to anybody. At its usual 64 KiB a picture of
760 × 428 goes over in 8 pieces, for each of which writer and reader wait for each other."""


def widen(descriptor: int) -> None:
    """Have a pipe hold a picture, where the system can; harmless where it cannot.

    Args:
        descriptor: of either end.
    """
    if sys.platform != "linux":
        return
    import fcntl

    with suppress(OSError):  # it is a file, or this user's pipes are wide already
        fcntl.fcntl(descriptor, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
