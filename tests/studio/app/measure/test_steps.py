"""Every step of the three days has a figure or a reason; some of the figures are measured."""

import pytest

from sim.faults.settings import LINES, NUMBERS
from studio.app.measure import designer, operator, tester
from studio.app.measure.steps import (
    MEASUREMENTS,
    OPEN,
    STEPS,
    in_order,
    open_rows,
    repeated_rows,
    step_rows,
)
from studio.app.measure.tester import FAULT_LINES
from studio.console.display import why_no_window
from studio.console.rows import Row

WHY_NOT = why_no_window()
REPEATED = {"D2": "studio.first_picture_s", "D9": "studio.fps"}


def test_every_step_has_a_figure_or_a_reason_and_not_both():
    given = [step for steps in MEASUREMENTS.values() for step in steps]
    assert sorted([*given, *OPEN, *REPEATED]) == sorted(STEPS)
    assert len(STEPS) == 30
    for name in MEASUREMENTS:
        owners = [module for module in (designer, operator, tester) if hasattr(module, name)]
        assert len(owners) == 1, name


def test_figures_of_other_rows_are_held_to_the_bars_of_the_steps():
    rows = [Row("studio.first_picture_s", 7.0, "s"), Row("studio.fps", 12.0, "1/s")]
    first, fps = repeated_rows(rows)
    assert (first.name, first.passed) == ("studio.D2.first_picture_s", False)
    assert (fps.name, fps.passed) == ("studio.D9.fps", True)
    assert repeated_rows([]) == []


def test_rows_come_in_the_order_of_the_tables():
    names = [row.name.split(".")[1] for row in in_order(open_rows()[::-1])]
    assert names == [step for step in STEPS if step in OPEN]


def test_there_is_a_line_for_every_fault():
    assert len(FAULT_LINES) == len(NUMBERS) + len(LINES)


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_physics_and_cutting_are_measured_in_processes_of_their_own(tmp_path):
    rows = {row.name: row for row in step_rows(tmp_path, ["D5", "D6"])}
    assert rows["studio.D5.files_changed_by_undo"].value == 0
    assert rows["studio.D5.objects"].value == 1
    assert rows["studio.D6.dragged_m"].value > 1.0
    assert rows["studio.D6.through_wall_mm"].passed


def test_a_measurement_that_crashes_fails_its_steps_and_no_other(tmp_path, monkeypatch):
    monkeypatch.setitem(MEASUREMENTS, "no_such_measurement", ("D4",))
    (row,) = step_rows(tmp_path, ["D4"])
    assert (row.name, row.passed) == ("studio.D4.crashes", False)
