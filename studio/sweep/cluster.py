"""All runs of a sweep on a Dask cluster: any worker plays any run, and one may die meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from studio.sweep.child import RunRefusedError, play_in_child
from studio.sweep.local import ATTEMPTS
from studio.sweep.plan import Run
from studio.sweep.results import run_hash

CONNECT_S = 10.0
"""How long the scheduler may take to answer, seconds: it is up, or it is not there."""


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
        from distributed import Client, as_completed
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
        for future in as_completed(list(begun), loop=client.loop):
            run = begun.pop(future)
            try:
                found = future.result()
            except KilledWorker as error:
                raise OSError(f"run {run.name}: its workers died: {error}") from None
            future.release()
            if "refused" in found:
                raise RunRefusedError(found["refused"])
            yield run, found
