"""All runs of a sweep on a Dask cluster: any worker plays any run, and one may die meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from studio.sweep.child import RunRefusedError, play_in_child
from studio.sweep.local import ATTEMPTS
from studio.sweep.plan import Run
from studio.sweep.results import run_hash

CONNECT_S = 10.0
"""How long the scheduler may take to answer, seconds: it is up, or it is not there."""

POLL_S = 0.1
"""Between two looks at which runs have ended, seconds: nothing beside a run's duration."""

LOOK_EVERY_S = 5.0
"""Between two looks at whether there are workers, seconds."""

WORKERLESS_S = 120.0
"""How long workers may all be gone, seconds: a nanny starts one again within some ten."""


def play_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """One run on a worker, from plain values; see `studio.sweep.child.play_in_child`.

    In a process of its own: graphics and kernels then never share one with the worker's threads.
    """
    run = Run(**{**values, "methods": tuple(values["methods"])})
    try:
        return play_in_child(run)
    except RunRefusedError as error:
        # As a value: the scheduler would try again what can never work.
        return {"refused": str(error)}


def play_on_cluster(
    runs: Sequence[Run],
    address: str,
    *,
    play: Callable[[Mapping[str, Any]], dict[str, Any]] = play_values,
) -> Iterator[tuple[Run, dict[str, Any]]]:
    """Every run with what it gave, as they end; those of a worker that dies go to another one.

    Args:
        runs: in any order.
        address: of the scheduler, such as "tcp://10.0.0.5:8786".
        play: what a worker does; the workers must be able to import it.

    Raises:
        ValueError: dask.distributed is missing, nobody answers at the address, or a run's input is
            wrong.
        OSError: a run's process or its workers died again and again.
    """
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise ValueError(
            "--cluster needs dask.distributed; install it with: pip install distributed"
        ) from None
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"--cluster {address}: no Dask scheduler answers within {CONNECT_S:g} s "
            f"({type(error).__name__}); start one with: dask scheduler"
        ) from None
    with client:
        begun = {
            client.submit(
                play,
                asdict(run),
                key=f"nexus-{run.name}-{run_hash(run)[:16]}",
                retries=ATTEMPTS - 1,
            ): run
            for run in runs
        }
        for future in _as_they_end(client, list(begun)):
            run = begun.pop(future)
            try:
                found = future.result()
            except KilledWorker as error:
                raise OSError(f"run {run.name}: its workers died: {error}") from None
            future.release()
            if "refused" in found:
                raise RunRefusedError(found["refused"])
            yield run, found


def _as_they_end(client: Any, waiting: list[Any]) -> Iterator[Any]:
    """The futures as they end.

    Raises:
        OSError: there has been no worker for `WORKERLESS_S`.
    """
    seen = time.monotonic()
    while waiting:
        ended = [future for future in waiting if future.done()]
        waiting = [future for future in waiting if future not in ended]
        yield from ended
        if ended:
            continue
        time.sleep(POLL_S)
        if time.monotonic() - seen < LOOK_EVERY_S:
            continue
        if client.nthreads():
            seen = time.monotonic()
        elif time.monotonic() - seen > WORKERLESS_S:
            raise OSError(
                f"{len(waiting)} runs left and no worker at the scheduler for {WORKERLESS_S:g} s; "
                "start one (dask worker ADDRESS) and the same sweep again: it goes on from here"
            )
