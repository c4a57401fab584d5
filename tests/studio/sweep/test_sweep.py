"""A sweep on this machine: every run once, whole or absent, and on again where it was ended."""

from __future__ import annotations

import json
import threading

import pytest

from studio.console.progress import Progress
from studio.sweep.child import RunDiedError, RunRefusedError
from studio.sweep.local import ATTEMPTS, play_here, shares
from studio.sweep.results import SweepFolder, run_hash
from studio.sweep.sweep import sweep


@pytest.fixture
def quiet(monkeypatch):
    monkeypatch.setattr("studio.sweep.sweep._fill_caches", lambda plan, progress: None)
    return Progress(lambda line, last: None)


def playing(give, played, *, stop_after=None):
    def play(runs):
        for run in runs:
            if stop_after is not None and len(played) == stop_after:
                raise KeyboardInterrupt
            played.append(run.name)
            yield run, give(run)

    return play


def test_every_run_is_played_and_the_rows_come_in_the_plan_s_order(fake, quiet, tmp_path):
    played = []
    backwards = playing(fake.give, played)
    rows = sweep(
        fake.plan, tmp_path / "s", progress=quiet, play=lambda runs: backwards(list(runs)[::-1])
    )
    wanted = [row for run in fake.plan.runs for row in fake.give(run)["rows"]]
    assert rows == wanted
    assert len(played) == len(fake.plan.runs) == 12
    written = json.loads((tmp_path / "s" / "sweep.json").read_text())
    assert written["rows"] == wanted
    assert len(list((tmp_path / "s" / "runs").iterdir())) == 12
    assert sorted(p.name for p in (tmp_path / "s").iterdir()) == [
        "runs",
        "sweep.html",
        "sweep.json",
    ]


def test_an_ended_sweep_goes_on_where_it_was(fake, quiet, tmp_path):
    first, second = [], []
    with pytest.raises(KeyboardInterrupt):
        sweep(fake.plan, tmp_path, progress=quiet, play=playing(fake.give, first, stop_after=5))
    assert not (tmp_path / "sweep.json").exists()
    rows = sweep(fake.plan, tmp_path, progress=quiet, play=playing(fake.give, second))
    assert len(first) == 5
    assert sorted(first + second) == sorted(run.name for run in fake.plan.runs)
    assert rows == [row for run in fake.plan.runs for row in fake.give(run)["rows"]]


def test_a_run_that_was_made_otherwise_or_half_written_is_played_again(fake, quiet, tmp_path):
    sweep(fake.plan, tmp_path, progress=quiet, play=playing(fake.give, []))
    runs = fake.plan.runs
    assert run_hash(runs[0]) != run_hash(runs[1])
    a, b = (tmp_path / "runs" / f"{run.name}.json" for run in runs[:2])
    a.write_text(b.read_text())
    b.write_text(b.read_text()[:40])
    again = []
    sweep(fake.plan, tmp_path, progress=quiet, play=playing(fake.give, again))
    assert again == [run.name for run in runs[:2]]


def test_a_folder_with_other_files_is_refused(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"thesis\.txt.*which no sweep wrote"):
        SweepFolder(tmp_path)
    with pytest.raises(ValueError, match="is a file"):
        SweepFolder(tmp_path / "thesis.txt")


def test_cores_are_dealt_out_evenly_and_each_once():
    assert shares((0, 1, 2, 3, 4), 2) == [(0, 2, 4), (1, 3)]
    assert shares((0, 1), 12) == [(0,), (1,)]
    assert shares((3,), 5) == [(3,)]


def test_no_two_runs_share_a_core(fake):
    busy, lock, most = [], threading.Lock(), []

    def play(run, *, cores, cancelled):
        with lock:
            assert not set(cores) & {core for share in busy for core in share}
            busy.append(cores)
            most.append(len(busy))
        cancelled.wait(0.01)
        with lock:
            busy.remove(cores)
        return fake.give(run)

    found = dict(play_here(fake.plan.runs, cores=(4, 7), play=play))
    assert {run.name: values["rows"] for run, values in found.items()} == {
        run.name: fake.give(run)["rows"] for run in fake.plan.runs
    }
    assert max(most) == 2


def test_a_run_whose_process_dies_is_begun_again_but_not_forever(fake):
    deaths = {}

    def play(run, *, cores, cancelled):
        deaths[run.name] = deaths.get(run.name, 0) + 1
        if deaths[run.name] < often:
            raise RunDiedError(f"run {run.name}: killed")
        return fake.give(run)

    often = ATTEMPTS
    assert len(list(play_here(fake.plan.runs[:3], cores=(0,), play=play))) == 3
    deaths.clear()
    often = ATTEMPTS + 1
    with pytest.raises(RunDiedError, match="none-seed-0: killed"):
        list(play_here(fake.plan.runs[:1], cores=(0,), play=play))
    assert deaths == {"none-seed-0": ATTEMPTS}


def test_a_run_that_cannot_be_played_ends_the_sweep_and_cancels_the_others(fake):
    def play(run, *, cores, cancelled):
        if run.fault == "none":
            raise RunRefusedError(f"run {run.name}: no such object")
        assert cancelled.wait(20.0)
        return fake.give(run)

    runs = [*fake.plan.runs[4:5], *fake.plan.runs[:1]]
    with pytest.raises(RunRefusedError, match="no such object"):
        list(play_here(runs, cores=(0, 1), play=play))
