"""Forks that change nothing give the same frames, tracks and poses, with the real tracker."""

import pytest

from sim.scenario import parse_scenario
from studio.bench.forks import INSTANTS_S, SCENARIO, SEED, measure_forks, play
from studio.session.session import SessionPlan


def test_forks_are_identical_in_the_middle_of_things(tmp_path):
    (row,) = measure_forks(tmp_path, instants_s=(1.37, 2.6))
    assert (row.name, row.value, row.passed) == ("twin.fork_identical", 2.0, True)


@pytest.mark.slow
def test_forks_at_ten_instants_are_identical(tmp_path):
    (row,) = measure_forks(tmp_path)
    assert (row.value, row.bar) == (10.0, 10)


def test_the_instants_lie_in_the_session_and_another_seed_differs(tmp_path):
    assert len(INSTANTS_S) == 10
    assert max(INSTANTS_S) < parse_scenario(SCENARIO, source="forks.toml").duration_s
    scenario = tmp_path / "forks.toml"
    scenario.write_text(SCENARIO)
    plans = [
        SessionPlan(scenario=str(scenario), seed=seed, methods=("own",))
        for seed in (SEED, SEED + 1)
    ]
    assert play(plans[0]) != play(plans[1])
