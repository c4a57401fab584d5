"""Memory of this program: measured, and given back to the operating system."""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path
from statistics import median

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Names of glibc's options, as `malloc.h` has them."""

LARGE_BYTES, KEPT_BYTES, HEAPS = 1 << 25, 1 << 28, 1
"""From which size a block has pages of its own: the most that older versions of glibc take, and
more than a lens picture, 25 MB at 2880 px. How many free bytes the heap keeps at its end: some tens
of pictures of 1440 px; what is between blocks it keeps until `return_free_pages`. How many heaps
all threads share: of a heap a thread each keeps the most that its thread ever needed."""

MIN_SAMPLES = 20
"""Samples from which growth is said, chosen: five for every quarter."""


def give_back_memory() -> None:
    """Collect what holds only itself, and return the free pages of the heap."""
    gc.collect()
    return_free_pages()


def collect_due() -> None:
    """Collect the oldest generation that is due, as Python does by itself while that is enabled."""
    due = [count > most for count, most in zip(gc.get_count(), gc.get_threshold(), strict=True)]
    if any(due):
        gc.collect(max(index for index, is_due in enumerate(due) if is_due))


def share_one_heap() -> None:
    """Have all threads share one heap, which keeps its pages until `return_free_pages`.

    By itself glibc makes a heap for every thread, and gives large blocks pages of their own, which
    the system fills with zeros anew each time: a picture of 1440 px is converted in 5.2 ms so, and
    in 1.0 ms where its pages are there. What is free between small blocks that stay goes back with
    `return_free_pages`, which whatever runs for long calls every few seconds. Other C libraries
    have no such call and need none.
    """
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)
    if set_option is not None:
        set_option(M_MMAP_THRESHOLD, LARGE_BYTES)
        set_option(M_TRIM_THRESHOLD, KEPT_BYTES)
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


def resident_kib(*, but: Collection[int] = ()) -> float:
    """Return the memory of this process and those that it has started, KiB.

    Args:
        but: ids of processes that do not count.
    """
    import resource  # not on every system, as the files below

    pages = 0
    for process in ("self", *_children()):
        if process == "self" or int(process) not in but:
            with suppress(OSError):  # it may have ended
                statm = Path("/proc", process, "statm").read_text(encoding="ascii")
                pages += int(statm.split()[1])
    return pages * resource.getpagesize() / 1024


def growth_percent(kib: Sequence[float]) -> float | None:
    """Return the growth from the second quarter to the last one, percent.

    A session that takes and returns pictures swings by a quarter of its memory within twenty
    seconds: tenths of a minute compare by chance where in the swing they fall.

    Args:
        kib: samples at even times; too few, or a system that does not say, give None.
    """
    if len(kib) < MIN_SAMPLES or min(kib) <= 0.0:
        return None
    quarter = len(kib) // 4
    before = median(kib[quarter : 2 * quarter])
    return 100.0 * (median(kib[-quarter:]) / before - 1.0)


def _children() -> list[str]:
    """Return the ids of the processes that this one has started."""
    found: list[str] = []
    for each in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):  # a thread may have ended
            found += each.read_text(encoding="ascii").split()
    return found
