"""Forks that change nothing give the same frames, tracks and poses, with the real tracker."""

import pytest

from benchmarks.twin import forks
from benchmarks.twin.forks import INSTANTS_S, SCENARIO, measure_forks
from sim.scenarios.scenario import parse_scenario


@pytest.mark.slow  # tests/studio/verbs/test_fork.py forks in the middle of a smaller session
def test_forks_are_identical_in_the_middle_of_things(tmp_path):
    (row,) = measure_forks(tmp_path, instants_s=(2.6,))
    assert (row.name, row.value, row.passed) == ("twin.fork_identical", 1.0, True)


@pytest.mark.slow
def test_forks_at_ten_instants_are_identical(tmp_path):
    (row,) = measure_forks(tmp_path)
    assert (row.value, row.bar) == (10.0, 10)


def test_the_instants_lie_in_the_session_and_a_difference_is_counted(tmp_path, monkeypatch):
    assert len(INSTANTS_S) == 10
    assert max(INSTANTS_S) < parse_scenario(SCENARIO, source="forks.toml").duration_s
    played = iter(["original", "original", "another", "original"])
    monkeypatch.setattr(forks, "play", lambda _plan: next(played))
    monkeypatch.setattr(forks, "open_fork", lambda *_given, **_named: None)
    (row,) = measure_forks(tmp_path, instants_s=(0.5, 1.0, 1.5))
    assert (row.value, row.bar, row.passed) == (2.0, 3, False)
