"""Lines and surfaces of several people, and undo for each."""

import numpy as np
import pytest

from devices.hub.board import (
    MAX_LINES,
    MAX_POINTS_IN_ALL,
    MAX_SURFACES,
    MAX_UNDO,
    ROOM,
    STEADY_NS,
    Board,
    Drawn,
    drawn_by_room,
    drawn_line,
    drawn_surface,
    own_key,
)
from devices.hub.messages import Do, OpError
from devices.hub.roles import Op
from scenes.state import Annotation, LiveSurface, SceneState, reduce_state

SQUARE = np.array([[0, 1, 0], [2, 1, 0], [2, 0, 0], [0, 0, 0]], dtype=float)


def line(key, count, x=0.0):
    return Do(1, Op.LINE, key, np.full((count, 3), x), (1.0, 0.0, 0.0))


def surface(key, corners=SQUARE):
    return Do(1, Op.SURFACE, key, corners)


UNDO = Do(1, Op.UNDO, "", np.zeros((0, 3)))


@pytest.fixture
def board():
    return Board()


def lines(board):
    return {key: len(it["points"]) for key, it in board.whole()["lines"].items()}


def test_nobody_overwrites_anothers(board):
    board.do("p1", line("a", 2), now_ns=0)
    board.do("p2", line("a", 3), now_ns=0)
    assert lines(board) == {"p1/a": 2, "p2/a": 3}
    board.do("p2", line("p2/a", 0), now_ns=0)
    assert lines(board) == {"p1/a": 2}
    with pytest.raises(OpError, match="belongs to somebody else"):
        board.do("p2", line("p1/a", 0), now_ns=0)
    assert own_key("p1", "a") == own_key("p1", "p1/a") == "p1/a"


def test_a_line_that_grew_is_undone_as_one(board):
    for count in range(2, 20):
        board.do("p1", line("a", count), now_ns=count)
    board.do("p1", line("b", 5), now_ns=30)
    assert board.do("p1", UNDO, now_ns=31).key == "p1/b"
    undone = board.do("p1", UNDO, now_ns=32)
    assert (undone.key, len(undone.points)) == ("p1/a", 0)
    assert lines(board) == {}
    with pytest.raises(OpError, match="nothing to undo"):
        board.do("p1", UNDO, now_ns=33)


def test_erasing_is_undone(board):
    board.do("p1", line("a", 5), now_ns=0)
    board.do("p1", line("a", 0), now_ns=1)
    assert lines(board) == {}
    assert len(board.do("p1", UNDO, now_ns=2).points) == 5
    assert len(board.do("p1", UNDO, now_ns=3).points) == 0


def test_erasing_what_is_not_there_is_nothing_to_undo(board):
    board.do("p1", line("a", 0), now_ns=0)
    with pytest.raises(OpError):
        board.do("p1", UNDO, now_ns=1)


def test_undo_takes_ones_own(board):
    board.do("p1", line("a", 2), now_ns=0)
    board.do("p2", line("b", 2), now_ns=1)
    board.do("p1", UNDO, now_ns=2)
    assert lines(board) == {"p2/b": 2}


def test_a_surface_carried_in_one_go_is_undone_as_one(board):
    board.do("p1", surface("s"), now_ns=0)
    at = 10 * STEADY_NS
    for step in range(1, 5):
        board.do("p1", surface("s", SQUARE + step), now_ns=at + step)
    back = board.do("p1", UNDO, now_ns=at + 10)
    np.testing.assert_array_equal(back.points, SQUARE)
    assert len(board.do("p1", UNDO, now_ns=at + 11).points) == 0


def test_who_is_gone_has_nothing_to_undo(board):
    board.do("p1", line("a", 2), now_ns=0)
    board.forget("p1")
    with pytest.raises(OpError):
        board.do("p1", UNDO, now_ns=1)
    assert lines(board) == {"p1/a": 2}


def test_everything_has_a_limit(board):
    per_line = MAX_POINTS_IN_ALL // 50
    for number in range(50):
        board.do("p1", line(f"l{number}", per_line), now_ns=0)
    with pytest.raises(OpError, match="erase some"):
        board.do("p1", line("more", 1), now_ns=0)
    board.do("p1", line("l0", per_line - 1), now_ns=0)
    board.do("p1", line("more", 1), now_ns=0)
    for number in range(MAX_SURFACES):
        board.do("p1", surface(f"s{number}"), now_ns=number * 2 * STEADY_NS)
    with pytest.raises(OpError, match="32 surfaces"):
        board.do("p1", surface("one more"), now_ns=0)
    board.do("p1", surface("s0", SQUARE + 1), now_ns=0)


def test_lines_and_undo_have_a_limit(board):
    for number in range(MAX_LINES):
        board.do("p1", line(f"l{number}", 1), now_ns=0)
    with pytest.raises(OpError, match="2000 lines"):
        board.do("p1", line("one more", 1), now_ns=0)
    for _ in range(MAX_UNDO):
        board.do("p1", UNDO, now_ns=0)
    with pytest.raises(OpError):
        board.do("p1", UNDO, now_ns=0)


def test_an_undo_that_has_no_room_stays_to_be_done(board):
    board.do("p1", line("gone", 100), now_ns=0)
    board.do("p1", line("gone", 0), now_ns=0)
    for number in range(50):
        board.do("p2", line(f"l{number}", 1000), now_ns=0)
    with pytest.raises(OpError, match="erase some"):
        board.do("p1", UNDO, now_ns=0)
    board.do("p2", line("l0", 0), now_ns=0)
    assert len(board.do("p1", UNDO, now_ns=0).points) == 100


def test_on_the_wire_y_is_up_and_z_in_the_session():
    drawn = Drawn(Op.LINE, "p1/a", "p1", np.array([[1.0, 2.0, 3.0]]), (0.1, 0.2, 0.3))
    annotation = drawn.annotation()
    np.testing.assert_allclose(annotation.points_in_world, [[1, -3, 2]])
    assert (annotation.annotation_id, annotation.user_id) == ("p1/a", "p1")
    back = drawn_line(annotation, by="room")
    assert back.entry() == {**drawn.entry(), "by": "room"}
    assert drawn.entry()["points"] == [[1, 2, 3]]


def test_a_surface_asks_for_a_picture_of_its_shape():
    made = Drawn(Op.SURFACE, "p1/s", "p1", SQUARE).surface()
    assert made.size_px == (1024, 512)
    np.testing.assert_allclose(made.corners_in_world[0], [0, 0, 1])
    back = drawn_surface(made, by="room")
    assert back.entry()["corners"] == SQUARE.tolist()
    assert Drawn(Op.SURFACE, "p1/s", "p1", np.zeros((4, 3))).surface().size_px == (16, 16)
    assert Drawn(Op.SURFACE, "p1/s", "p1", np.zeros((0, 3))).surface().corners_in_world.shape == (
        0,
        3,
    )


def test_what_the_room_draws_itself_is_found():
    mine = Annotation("a", "designer", np.zeros((2, 3)), (1, 1, 1))
    theirs = Annotation("p1/a", "p1", np.zeros((2, 3)), (1, 1, 1))
    screen = LiveSurface("tv", SQUARE, (16, 16), "cam")
    empty = SceneState()
    state = empty
    for change in (mine, theirs, screen):
        state = reduce_state(state, change, 0)

    def between(before, after):
        found = drawn_by_room(before, after, is_known=lambda value: value is theirs)
        return [(it.op, it.key, it.by, len(it.points)) for it in found]

    assert between(empty, state) == [
        (Op.LINE, "a", ROOM, 2),
        (Op.SURFACE, "tv", ROOM, 4),
    ]
    assert between(state, state) == []
    assert sorted(between(state, empty)) == [
        (Op.LINE, "a", ROOM, 0),
        (Op.LINE, "p1/a", ROOM, 0),
        (Op.SURFACE, "tv", ROOM, 0),
    ]
