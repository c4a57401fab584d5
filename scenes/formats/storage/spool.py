# pyright: standard
"""Columns that are set aside on disk until the rows before them are known."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

COPY_BYTES = 1 << 20


@contextmanager
def spools(path: Path, count: int) -> Iterator[list[IO[bytes]]]:
    """Nameless temporary files in the folder of `path`, which vanish whatever happens.

    They are where the file is going to be, since that place must have room for it anyway.

    Raises:
        OSError: the folder is missing, full or not writable.
    """
    with ExitStack() as stack:
        yield [
            stack.enter_context(tempfile.TemporaryFile(dir=path.resolve().parent))
            for _ in range(count)
        ]


def contents(spool: IO[bytes], size: int = COPY_BYTES) -> Iterator[bytes]:
    """All that was written to a spool, at most `size` bytes at a time."""
    spool.seek(0)
    while data := spool.read(size):
        yield data
