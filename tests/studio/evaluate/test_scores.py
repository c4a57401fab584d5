import numpy as np
import pytest

from studio.evaluate.scores import ScoreBoard, accuracy_rows
from studio.session.plan import SessionPlan


@pytest.fixture
def board(tiny):
    board = ScoreBoard(tiny.scene.objects)
    session = tiny.session(SessionPlan(methods=("own",)), offset_m=0.04, offset_rad=0.05)
    session.run(
        lambda output: board.add(output.tracks["own"].objects, output.message.truth.recorded)
    )
    return board


def test_only_moved_objects_count_and_from_their_first_motion_to_the_end(board, tiny):
    assert [m.object_id for m in board.moved()] == ["chair-1"]
    score = board.score()
    assert score.world_cm.count == tiny.frames - tiny.starts
    assert score.world_cm.mean == pytest.approx(4.0)
    assert score.yaw_deg.mean == pytest.approx(np.degrees(0.05))


def test_hidden_and_visible_spans_share_the_frames(board, tiny):
    hidden, visible = board.score(hidden=True), board.score(hidden=False)
    assert hidden.world_cm.count == len(tiny.hidden)
    assert hidden.world_cm.count + visible.world_cm.count == board.score().world_cm.count


def test_the_yaw_of_a_round_stool_is_not_scored(board):
    assert not board.has_yaw("stool-1")
    assert board.has_yaw("chair-1")
    assert all(s.error.yaw_deg == 0 for s in board.samples("stool-1"))


def test_rows_have_the_contract_names_and_bars(board):
    rows = {row.name: row for row in accuracy_rows(board)}
    assert rows["rehearse.chairs.world_cm.mean"].bar == 9.9
    assert rows["rehearse.chairs.yaw_deg.mean"].bar == 5.7
    assert rows["rehearse.objects.world_cm.mean"].passed is True
    assert "rehearse.objects.world_cm.p95" in rows
    assert rows["rehearse.object.chair-1.world_cm.mean"].value == pytest.approx(4.0)
    other = accuracy_rows(board, prefix="rehearse.paper", bars=False)
    assert all(row.bar is None and row.name.startswith("rehearse.paper.") for row in other)


def test_bars_are_missed_when_the_tracker_is_off(tiny):
    board = ScoreBoard(tiny.scene.objects)
    session = tiny.session(SessionPlan(methods=("own",)), offset_m=0.2, offset_rad=0.3)
    session.run(
        lambda output: board.add(output.tracks["own"].objects, output.message.truth.recorded)
    )
    failed = {row.name for row in accuracy_rows(board) if row.passed is False}
    assert failed == {
        "rehearse.chairs.world_cm.mean",
        "rehearse.chairs.yaw_deg.mean",
        "rehearse.objects.world_cm.mean",
    }


def test_nothing_moved_is_not_a_pass(tiny):
    (row,) = accuracy_rows(ScoreBoard(tiny.scene.objects))
    assert row.value is None
    assert row.passed is None
