"""All runs of a sweep on this machine: one process a run, each on cores of its own."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, Protocol

from studio.sweep.child import RunDiedError, play_in_child
from studio.sweep.plan import Run

ATTEMPTS = 3
"""How often a run is begun whose process dies: once more than by accident twice."""


class PlayRun(Protocol):
    """Plays one run; see `studio.sweep.child.play_in_child`."""

    def __call__(
        self, run: Run, *, cores: Sequence[int], cancelled: threading.Event
    ) -> dict[str, Any]:
        """Return the result of `studio.sweep.play.play`."""
        ...


def usable_cores() -> tuple[int, ...]:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return tuple(sorted(os.sched_getaffinity(0)))
    return tuple(range(os.cpu_count() or 1))


def shares(cores: Sequence[int], jobs: int) -> list[tuple[int, ...]]:
    """The cores dealt out to at most `jobs` runs at a time, as evenly as it goes."""
    count = max(1, min(jobs, len(cores)))
    return [tuple(cores[k::count]) for k in range(count)]


def play_here(
    runs: Sequence[Run],
    *,
    cores: Sequence[int] | None = None,
    play: PlayRun = play_in_child,
) -> Iterator[tuple[Run, dict[str, Any]]]:
    """Every run with what it gave, as they end.

    Args:
        runs: in any order.
        cores: to use; all if None.
        play: plays one run.

    Raises:
        RunDiedError: a run's process died `ATTEMPTS` times.
        RunRefusedError: a run's input is wrong.
    """
    dealt = shares(usable_cores() if cores is None else cores, len(runs))
    free: queue.Queue[tuple[int, ...]] = queue.Queue(len(dealt))
    for share in dealt:
        free.put(share)
    cancelled = threading.Event()

    def one(run: Run) -> dict[str, Any]:
        share = free.get()
        try:
            return persistently(lambda: play(run, cores=share, cancelled=cancelled))
        finally:
            free.put(share)

    with ThreadPoolExecutor(max_workers=len(dealt)) as pool:
        begun: dict[Future[dict[str, Any]], Run] = {pool.submit(one, run): run for run in runs}
        try:
            while begun:
                ended, _ = wait(begun, return_when=FIRST_COMPLETED)
                for future in ended:
                    yield begun.pop(future), future.result()
        finally:
            cancelled.set()
            pool.shutdown(cancel_futures=True)


def persistently(play: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return the result of a run, begun again if its process dies, at most `ATTEMPTS` times.

    Raises:
        RunDiedError: it died each time.
    """
    for _ in range(ATTEMPTS - 1):
        try:
            return play()
        except RunDiedError:
            continue
    return play()
