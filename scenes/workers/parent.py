"""Ends a child process whose parent is gone."""

from __future__ import annotations

import os
from collections.abc import Callable

from scenes.workers.task import Task

STDIN = 0
"""Descriptor of standard input."""

READ_BYTES = 4096
"""Bytes read at a time from a pipe on which nothing is expected."""


def end_with_parent(
    read: Callable[[], bytes] = lambda: os.read(STDIN, READ_BYTES), *, code: int = 1
) -> Task[None]:
    """End this process at once when the other end of a pipe closes, however its parent died.

    A pipe rather than a signal of the kernel: that comes when the parent's thread ends, too.

    Args:
        read: waits for bytes of the pipe; empty at its end. Standard input by default.
        code: exit status.
    """

    def watch(_task: Task[None]) -> None:
        while read():
            pass
        os._exit(code)

    return Task("end with parent", watch).start()
