"""Gives memory that nobody uses any more back to the operating system."""

from __future__ import annotations

import ctypes
import gc


def give_back_memory() -> None:
    """Collect what holds only itself, and return the free pages of the heap."""
    gc.collect()
    return_free_pages()


def return_free_pages() -> None:
    """Return the free pages of the heap: quick enough to be called in a running session.

    glibc keeps the pages that threads have freed: 500 MB after a rehearsal of the lab, and in a
    live one more from minute to minute, as large pictures of several threads leave gaps. Other C
    libraries have no such call and return pages by themselves.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
