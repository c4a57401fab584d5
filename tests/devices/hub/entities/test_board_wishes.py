"""A board of a site, which asks the room for shapes, and learns from it whose they are."""

from dataclasses import replace

import pytest

from devices.hub.entities.board import HOLD_NS, STEADY_NS, Board
from devices.hub.roles import Op
from tests.devices.hub.entities.test_board import UNDO, body, gift, line, places


@pytest.fixture
def board():
    return Board()


def test_nobody_takes_back_what_the_room_says_is_somebody_elses(board):
    board.do("p1", body("a"), now_ns=0, name="Ann")
    board.do("p1", body("b"), now_ns=0, name="Ann")
    board.do("p1", body("a", 2.0), now_ns=9 * HOLD_NS, name="Ann")
    board.put(replace(body("p1/a", 2.0).drawn, by="north.p1"))
    board.do("p1", UNDO, now_ns=9 * HOLD_NS)
    assert places(board, "primitives") == {"p1/a": 2.0}, "the other one went"


def test_at_a_site_shapes_are_asked_of_the_room(board):
    asked = board.wish("p1", body("a"), now_ns=0)
    assert (asked.op, asked.drawn.key, asked.drawn.by) == (Op.PRIMITIVE, "p1/a", "p1")
    assert board.whole()["primitives"] == {}, "the room has not decided"
    assert board.wish("p1", gift("a", "lab.p1"), now_ns=0).drawn.key == "p1/a"
    assert board.wish("p1", line("b", 2), now_ns=0) is None
    # Moved again before the room has answered: each undo asks for what was before.
    board.wish("p1", body("a", 3.0), now_ns=STEADY_NS // 2)
    board.wish("p1", body("a", 5.0, drag=7), now_ns=STEADY_NS // 2)
    undone = board.wish("p1", UNDO, now_ns=STEADY_NS)
    assert (undone.op, undone.drawn.room_from_entity.translation[0]) == (Op.PRIMITIVE, 3.0)
    assert not board.wish("p1", UNDO, now_ns=STEADY_NS).drawn.is_there
    assert board.wish("p1", UNDO, now_ns=STEADY_NS) is None


def test_what_the_room_refused_is_not_to_be_taken_back(board):
    board.wish("p1", body("a"), now_ns=0)
    board.see_refused("p1", "p1/a")
    assert board.wish("p1", UNDO, now_ns=1) is None
    board.put(replace(body("b").drawn, key="lab.p1/b", by="lab.p1"))
    board.wish("p1", body("lab.p1/b", 9.0), now_ns=2)
    board.see_refused("p1", "lab.p1/b")
    assert board.wish("p1", UNDO, now_ns=3) is None
