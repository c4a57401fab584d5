"""Gives memory that nobody uses any more back to the operating system."""

from __future__ import annotations

import ctypes
import gc

M_MMAP_THRESHOLD, M_ARENA_MAX = -3, -8
"""Names of glibc's options, as `malloc.h` has them."""

LARGE_BYTES, HEAPS = 1 << 20, 1
"""From which size a block has pages of its own, and how many heaps all others share, chosen: of
eight ways tried, these together kept the least from round to round. Threads keep small blocks of
their own, and large ones come from no heap: few wait for each other."""


def give_back_memory() -> None:
    """Collect what holds only itself, and return the free pages of the heap."""
    gc.collect()
    return_free_pages()


def keep_heap_small() -> None:
    """Have large blocks given back as soon as they are freed, and one heap for all threads.

    By itself glibc makes a heap for every thread, and after the first picture that is freed takes
    the next ones from there: between small blocks that stay, pages that nobody uses add up. Seven
    rounds of opening, rehearsing and closing keep 390 MB more than the first so, and 4 MB like
    this. Other C libraries have no such call and need none.
    """
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)
    if set_option is not None:
        set_option(M_MMAP_THRESHOLD, LARGE_BYTES)
        set_option(M_ARENA_MAX, HEAPS)


def return_free_pages() -> None:
    """Return the free pages of the heap: quick enough to be called in a running session.

    glibc keeps the pages that threads have freed: 500 MB after a rehearsal of the lab, and in a
    live one more from minute to minute, as large pictures of several threads leave gaps. Other C
    libraries have no such call and return pages by themselves.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
