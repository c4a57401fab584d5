"""Gives memory that nobody uses any more back to the operating system."""

from __future__ import annotations

import ctypes
import gc


def give_back_memory() -> None:
    """Collect what holds only itself, and return the free pages of the heap.

    glibc keeps the pages that threads have freed: 500 MB after a rehearsal of the lab. Other C
    libraries have no such call and return pages by themselves.
    """
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
