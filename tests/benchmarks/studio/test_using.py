"""What hours of use leave in memory: the figures, and one short use of the real window."""

import pytest

from benchmarks.studio.soaking import scenario_of
from benchmarks.studio.using import FORK_S, LATER, SESSION_S, memory_rows, use_rows
from sim.faults.light import Exposure
from sim.scenarios.scenario import parse_scenario
from studio.console.display import why_no_window

WHY_NOT = why_no_window()


def named(rows):
    return {row.name: row for row in rows}


def test_memory_is_held_to_its_bar_and_to_what_the_first_session_left():
    rows = named(memory_rows([1000.0, 1090.0, 1200.0, 1095.0, 1080.0]))
    assert rows["studio.use.rss_gb"].value == pytest.approx(1095.0 / 1024)
    assert rows["studio.use.growth_percent"].value == pytest.approx(9.5)
    assert rows["studio.use.growth_percent"].passed
    assert rows["studio.use.rounds"].value == 4


def test_what_is_changed_for_a_fork_lies_after_it_and_before_the_end():
    faults = parse_scenario(scenario_of(SESSION_S) + LATER, source="use").faults
    assert not faults.at(Exposure, FORK_S)
    assert faults.at(Exposure, 0.5 * (FORK_S + SESSION_S))


def test_growth_and_size_beyond_their_bars_miss_them():
    rows = named(memory_rows([1400.0, 1600.0]))
    assert rows["studio.use.rss_gb"].passed is False
    assert rows["studio.use.growth_percent"].passed is False


def test_a_use_that_crashes_is_a_figure_that_fails(tmp_path, monkeypatch):
    monkeypatch.setattr("benchmarks.studio.using.measured", measured_crash)
    (row,) = use_rows(1.0, tmp_path)
    assert (row.name, row.passed) == ("studio.use.crashes", False)


def measured_crash(*_words):
    import subprocess

    raise subprocess.CalledProcessError(-11, "using")


@pytest.mark.slow
@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_a_round_of_everything_is_used_and_fits(tmp_path):
    rows = named(use_rows(0.01, tmp_path))
    assert rows["studio.use.rounds"].value == 1
    assert all(row.passed is not False for row in rows.values())
