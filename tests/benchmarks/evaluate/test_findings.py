import re

import numpy as np
import pytest

from benchmarks.evaluate.findings import aligned, error_rows, paper_columns
from benchmarks.evaluate.protocols.stations import Sample, Station
from benchmarks.evaluate.tables.paper_tables import (
    CHI2_95_OF_4,
    coverage_row,
    noticed,
    squared_distance,
)
from scenes.pose import Pose
from studio.evaluate.metrics import PAPER_ROOM, PoseError, pose_error


def error(world_cm, yaw_deg):
    return PoseError(world_cm, 0.0, 0.0, world_cm, yaw_deg)


def test_rows_carry_the_names_of_the_bars_and_only_ours_are_held_to_them():
    errors = [error(1.0, 0.5), error(3.0, 30.0)]
    bars = {"world_cm.mean": 1.5, "flips": 0}
    own = {row.name: row for row in error_rows("own", "room", errors, bars=bars)}
    assert own["room.world_cm.mean"].value == pytest.approx(2.0)
    assert own["room.world_cm.mean"].passed is False
    assert own["room.flips"].value == 1
    assert own["room.yaw_deg.max"].passed is None
    paper = {row.name: row for row in error_rows("paper", "room", errors, bars=bars)}
    assert paper["paper.room.world_cm.mean"].passed is None


def test_a_round_thing_has_no_yaw():
    names = [row.name for row in error_rows("own", "x", [error(1, 0)], bars={}, with_yaw=False)]
    assert names == ["x.world_cm.mean", "x.world_cm.std", "x.world_cm.p95", "x.world_cm.max"]


def test_the_table_has_the_paper_s_columns_and_its_up_under_ours():
    text = paper_columns("room", {"P1": [error(2.0, 1.0)]}, printed=PAPER_ROOM)
    printed = next(line for line in text.splitlines() if line.startswith("paper, printed"))
    # x 5.6, our y (away) is the paper's z 2.7, our z (up) is the paper's y 5.3.
    cells = "paper, printed|5.6 ± 6.3|2.7 ± 4.6|5.3 ± 5.1|9.9 ± 4.4|5.7 ± 12.0"
    assert re.sub(r" {2,}", "|", printed) == cells


def test_cells_are_aligned():
    assert aligned([["a", "10"], ["bcd", "9"]]) == "a    10\nbcd   9"


def sample(answer, shift_m):
    true = Pose.from_yaw(0.1, (1.0, 2.0, 0.0))
    seen = answer({"chair-1": true}, off={"chair-1": (shift_m, 0.0)})
    track = seen.tracks["chair-1"]
    return Sample(0, Station(1, 0.0, true), track, seen, pose_error(track.world_from_object, true))


def test_the_ellipsoid_holds_what_it_should(answer):
    """The tracks of the fixture say 1 cm: 95 % of errors lie within 3.08 cm, four unknowns."""
    edge = 0.01 * np.sqrt(CHI2_95_OF_4)
    assert squared_distance(sample(answer, 0.02)) == pytest.approx(4.0)
    row = coverage_row("own", "c", [sample(answer, f * edge) for f in (0.5, 0.9, 0.99, 1.01)])
    assert row.value == pytest.approx(0.75)
    assert row.passed is False
    held = coverage_row("own", "c", [sample(answer, 0.9 * edge)] * 19 + [sample(answer, 2 * edge)])
    assert held.passed is True
    assert coverage_row("own", "c", [sample(answer, 0.0)] * 20).passed is False


def test_a_pose_that_did_not_change_was_not_estimated_again(answer):
    first, second, third = sample(answer, 0.02), sample(answer, 0.02), sample(answer, 0.03)
    assert noticed([first, second, third]) == [first, third]
    assert noticed([]) == []
