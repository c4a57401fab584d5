"""A sweep on a Dask cluster of two workers, one of which is killed in the middle."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from studio.sweep.child import RunRefusedError
from studio.sweep.cluster import play_on_cluster

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module", autouse=True)
def scratch(tmp_path_factory):
    """What Dask leaves goes with the tests' own folders."""
    import dask

    folder = str(tmp_path_factory.mktemp("scratch"))
    with dask.config.set({"temporary-directory": folder}):
        yield folder


@pytest.fixture(scope="module")
def cluster(scratch):
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
        local_directory=scratch,
    ) as made:
        yield made


def slowly(values, folder):
    """A run that takes a while and says who plays it; its figures follow from its values."""
    (Path(folder) / f"{values['name']}.{os.getpid()}").touch()
    time.sleep(0.4)
    return {"rows": [{"fault": values["fault"], "size": values["size"], "seed": values["seed"]}]}


def given(run):
    return [{"fault": run.fault, "size": run.size, "seed": run.seed}]


@pytest.fixture
def by_value():
    """Workers cannot import tests: what they play is sent along."""
    import sys

    import cloudpickle

    module = sys.modules[__name__]
    cloudpickle.register_pickle_by_value(module)
    yield
    cloudpickle.unregister_pickle_by_value(module)


def test_a_worker_that_is_killed_loses_no_run(fake, cluster, by_value, tmp_path):
    from functools import partial

    found = {}
    killed = None
    play = partial(slowly, folder=str(tmp_path))
    for run, values in play_on_cluster(fake.plan.runs, cluster.scheduler_address, play=play):
        assert run.name not in found
        found[run.name] = values["rows"]
        if killed is None and len(found) == 2:
            killed = int(next(iter(tmp_path.iterdir())).suffix[1:])
            os.kill(killed, signal.SIGKILL)
    assert found == {run.name: given(run) for run in fake.plan.runs}
    players = {int(path.suffix[1:]) for path in tmp_path.iterdir()}
    assert killed in players
    assert len(players) >= 2


def refuse(values):
    return {"refused": f"run {values['name']}: no such object"}


def test_a_run_that_cannot_be_played_is_not_tried_again(fake, cluster, by_value):
    with pytest.raises(RunRefusedError, match="no such object"):
        list(play_on_cluster(fake.plan.runs[:2], cluster.scheduler_address, play=refuse))


def die(values):
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_run_that_kills_every_worker_ends_the_sweep(fake, cluster, by_value, monkeypatch):
    monkeypatch.setattr("studio.sweep.cluster.WORKERLESS_S", 30.0)
    # On a busy machine the workers are given up before the run is.
    with pytest.raises(OSError, match=r"run none-seed-0: its workers died|no worker"):
        list(play_on_cluster(fake.plan.runs[:1], cluster.scheduler_address, play=die))


def test_a_cluster_without_workers_is_not_waited_for_forever(fake, by_value, tmp_path, monkeypatch):
    for name, seconds in (("LOOK_EVERY_S", 0.1), ("WORKERLESS_S", 0.3)):
        monkeypatch.setattr(f"studio.sweep.cluster.{name}", seconds)
    with (
        distributed.LocalCluster(
            n_workers=0,
            processes=True,
            dashboard_address="127.0.0.1:0",
            host="127.0.0.1",
            local_directory=str(tmp_path),
        ) as empty,
        pytest.raises(OSError, match=r"2 runs left and no worker .* same sweep again"),
    ):
        list(play_on_cluster(fake.plan.runs[:2], empty.scheduler_address, play=refuse))


def test_nobody_at_the_address_is_one_clear_line(fake, monkeypatch):
    monkeypatch.setattr("studio.sweep.cluster.CONNECT_S", 0.5)
    with pytest.raises(ValueError, match=r"--cluster tcp://127\.0\.0\.1:9: no Dask scheduler"):
        list(play_on_cluster(fake.plan.runs[:1], "tcp://127.0.0.1:9"))
    with pytest.raises(ValueError, match="--cluster nonsense://x: no Dask scheduler"):
        list(play_on_cluster(fake.plan.runs[:1], "nonsense://x"))
