"""Every step of the three days has a figure or a reason; some of the figures are measured."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.studio.tasks import designer, operator, scaling, tester
from benchmarks.studio.tasks.steps import (
    MEASUREMENTS,
    OPEN,
    STEPS,
    in_order,
    open_rows,
    repeated_rows,
    step_rows,
)
from benchmarks.studio.tasks.tester import FAULT_LINES
from scenes.pose import Pose, rotation_from_vector
from sim.faults.settings import LINES, NUMBERS
from studio.console.display import why_no_window
from studio.console.rows import Row
from tracking.output import CameraMoment, CameraNotice

WHY_NOT = why_no_window()
REPEATED = {"D2": "studio.first_picture_s", "D9": "studio.fps"}


def test_every_step_has_a_figure_or_a_reason_and_not_both():
    given = [step for steps in MEASUREMENTS.values() for step in steps]
    assert sorted([*given, *OPEN, *REPEATED]) == sorted(STEPS)
    assert len(STEPS) == 30
    for name in MEASUREMENTS:
        modules = (designer, scaling, operator, tester)
        owners = [module for module in modules if hasattr(module, name)]
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


def test_rows_of_a_live_camera_stand_with_the_step_that_asks_for_them():
    rows = [Row(name, 1.0, "") for name in ("studio.T1.x", "live.bump.noticed_s", "studio.O5.x")]
    assert [row.name for row in in_order(rows)] == [
        "studio.O5.x", "live.bump.noticed_s", "studio.T1.x",
    ]  # fmt: skip


def test_a_bump_is_judged_by_what_lies_still():
    still, pushed = Pose.identity(), Pose.from_yaw(0.0, (0.3, 0.0, 0.0))
    slid = Pose.from_yaw(0.0, (0.06, 0.0, 0.0))
    turned = Pose(rotation_from_vector(np.radians((0.0, 2.0, 0.0))), np.zeros(3))

    def shown(a, b, rig, *notices):
        tracks = [
            SimpleNamespace(object_id=n, world_from_object=p) for n, p in (("a", a), ("b", b))
        ]
        return SimpleNamespace(objects=tracks, world_from_rig=rig, notices=notices)

    bumped = CameraNotice(CameraMoment.BUMPED, 2.0, 0.0)
    lies, moves = {"a": still, "b": still}, {"a": still, "b": pushed}
    good = [
        (1.8, shown(still, still, still), lies),
        (2.0, shown(still, still, still), lies),
        (2.4, shown(still, pushed, turned, bumped), moves),
    ]
    found = operator.judged_bump(good, 2.0, at_s=2.0, lasts_s=6.0)
    assert found.thrown == frozenset()
    assert (found.noticed_s, found.followed_s) == pytest.approx((0.4, 0.4))
    assert found.moved_cm == 0.0
    bad = [*good[:2], (2.4, shown(slid, pushed, still), moves)]
    worse = operator.judged_bump(bad, 2.0, at_s=2.0, lasts_s=6.0)
    assert worse.thrown == {"a"}
    assert worse.moved_cm == pytest.approx(6.0)
    assert (worse.noticed_s, worse.followed_s) == (6.0, 6.0)


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
    monkeypatch.setitem(MEASUREMENTS, "no_such_measurement", ("O8",))
    (row,) = step_rows(tmp_path, ["O8"])
    assert (row.name, row.passed) == ("studio.O8.crashes", False)
