"""Entities of several people, their limits, and undo for each."""

import numpy as np
import pytest

from devices.hub.entities.board import (
    HOLD_NS,
    MAX_LINES,
    MAX_POINTS_IN_ALL,
    MAX_PRIMITIVES,
    MAX_PRIMITIVES_EACH,
    MAX_PROPOSALS,
    MAX_PROPOSALS_EACH,
    MAX_SURFACES,
    MAX_UNDO,
    STEADY_NS,
    Board,
    own_key,
)
from devices.hub.entities.drawn import Drawn
from devices.hub.protocol.messages import Do, OpError
from devices.hub.roles import Op, Person, Role
from scenes.pose import Pose

SQUARE = np.array([[0, 1, 0], [2, 1, 0], [2, 0, 0], [0, 0, 0]], dtype=float)


def line(key, count, x=0.0):
    return Do(1, Op.LINE, Drawn(Op.LINE, key, "", np.full((count, 3), x), (1.0, 0.0, 0.0)))


def surface(key, corners=SQUARE, **drawn):
    return Do(1, Op.SURFACE, Drawn(Op.SURFACE, key, "", corners, **drawn))


def body(key, x=0.0, *, shape="box", drag=None):
    pose = Pose.from_yaw(0.0, (x, 0, 0))
    drawn = Drawn(Op.PRIMITIVE, key, "", shape=shape, size_m=(0.3, 0.3, 0.3), room_from_entity=pose)
    return Do(1, Op.PRIMITIVE, drawn, drag)


def proposal(key, x=0.0, *, object_id="chair-1", drag=None):
    pose = Pose.from_yaw(0.0, (x, 0, 0))
    return Do(
        1, Op.PROPOSE, Drawn(Op.PROPOSE, key, "", room_from_entity=pose, object_id=object_id), drag
    )


UNDO = Do(1, Op.UNDO)


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


def places(board, kind):
    return {key: it["pose"][0] for key, it in board.whole()[kind].items()}


@pytest.mark.parametrize(("make", "kind"), [(body, "primitives"), (proposal, "proposals")])
def test_one_drag_is_one_undo_however_long_it_takes(board, make, kind):
    board.do("p1", make("a", 0.0), now_ns=0)
    for step in range(1, 5):
        board.do("p1", make("a", step, drag=7), now_ns=step * 3 * STEADY_NS)
    for step in range(5, 9):
        board.do("p1", make("a", step, drag=8), now_ns=12 * STEADY_NS + step)
    assert places(board, kind) == {"p1/a": 8}
    for left in (4, 0):
        board.do("p1", UNDO, now_ns=99 * STEADY_NS)
        assert places(board, kind) == {"p1/a": left}
    assert not board.do("p1", UNDO, now_ns=99 * STEADY_NS).is_there
    assert places(board, kind) == {}


def test_what_is_put_and_carried_in_one_drag_is_undone_as_one(board):
    for step in range(5):
        board.do("p1", proposal("a", step, drag="d1"), now_ns=step * 2 * STEADY_NS)
    board.do("p1", UNDO, now_ns=0)
    assert places(board, "proposals") == {}


def test_drags_of_two_entities_are_two_undos(board):
    board.do("p1", body("a", drag=1), now_ns=0)
    board.do("p1", body("b", drag=1), now_ns=0)
    board.do("p1", UNDO, now_ns=0)
    assert places(board, "primitives") == {"p1/a": 0}


def test_what_is_erased_comes_back_as_it_was(board):
    board.do("p1", body("a", 2.0), now_ns=0)
    board.do("p1", body("a", shape=None), now_ns=1)
    assert places(board, "primitives") == {}
    back = board.do("p1", UNDO, now_ns=2)
    assert (back.shape, back.room_from_entity.translation[0]) == ("box", 2.0)
    board.do("p1", proposal("c", 1.0), now_ns=3)
    board.do("p1", proposal("c", object_id=""), now_ns=4)
    assert board.do("p1", UNDO, now_ns=5).object_id == "chair-1"


def test_a_surface_carried_away_is_put_back_by_undo(board):
    board.do("p1", surface("s"), now_ns=0)
    board.do("p1", surface("s", seen=SQUARE + 1), now_ns=2 * STEADY_NS)
    (there,) = board.whole()["surfaces"].values()
    assert there["seen"] == (SQUARE + 1).tolist()
    assert there["corners"] == SQUARE.tolist()
    board.do("p1", UNDO, now_ns=3 * STEADY_NS)
    (there,) = board.whole()["surfaces"].values()
    assert "seen" not in there


@pytest.mark.parametrize(
    ("make", "most", "each"),
    [(body, MAX_PRIMITIVES, MAX_PRIMITIVES_EACH), (proposal, MAX_PROPOSALS, MAX_PROPOSALS_EACH)],
)
def test_nobody_takes_all_the_room(board, make, most, each):
    for number in range(each):
        board.do("p1", make(f"n{number}"), now_ns=number * 2 * STEADY_NS)
    with pytest.raises(OpError, match="of yours"):
        board.do("p1", make("more"), now_ns=0)
    board.do("p1", make("n0", 5.0), now_ns=0)
    for person in range(2, most // each + 1):
        for number in range(each):
            board.do(f"p{person}", make(f"n{number}"), now_ns=2 * person * HOLD_NS)
    with pytest.raises(OpError, match=f"{most} p"):
        board.do("last", make("more"), now_ns=0)


def test_a_proposal_has_its_owners_name(board):
    board.do("p1", proposal("a"), now_ns=0, name="Ann")
    assert board.whole()["proposals"]["p1/a"]["name"] == "Ann"
    with pytest.raises(OpError, match="somebody else"):
        board.do("p2", proposal("p1/a", object_id=""), now_ns=0)


def test_who_moves_an_object_first_has_it_until_they_let_go(board):
    """Two people move the same chair: the hub's order decides, and everybody has its log."""
    board.do("p1", proposal("a"), now_ns=0, name="Ann")
    with pytest.raises(OpError, match="Ann is moving it"):
        board.do("p2", proposal("b", 1.0), now_ns=HOLD_NS // 2, name="Ben")
    board.do("p2", proposal("c", object_id="chair-2"), now_ns=HOLD_NS // 2, name="Ben")
    board.do("p1", proposal("a", 0.1), now_ns=HOLD_NS // 2, name="Ann")
    with pytest.raises(OpError):
        board.do("p2", proposal("b", 1.0), now_ns=HOLD_NS, name="Ben")
    board.do("p2", proposal("b", 1.0), now_ns=2 * HOLD_NS, name="Ben")
    with pytest.raises(OpError, match="Ben is moving it"):
        board.do("p1", proposal("a", 0.2), now_ns=2 * HOLD_NS + 1, name="Ann")
    assert set(board.whole()["proposals"]) == {"p1/a", "p2/b", "p2/c"}
    # Taking it away lets go at once, and so does leaving.
    board.do("p2", proposal("b", object_id=""), now_ns=2 * HOLD_NS + 2, name="Ben")
    board.do("p1", proposal("a", 0.2), now_ns=2 * HOLD_NS + 3, name="Ann")
    board.forget("p1")
    board.do("p2", proposal("b", 1.0), now_ns=2 * HOLD_NS + 4, name="Ben")


HERE = {
    name: Person(name, index, called, role)
    for index, (name, called, role) in enumerate(
        [
            ("p1", "Ann", Role.LOCAL),
            ("p2", "Ben", Role.REMOTE),
            ("p3", "Cleo", Role.REMOTE),
            ("p4", "Sam", Role.SPECTATOR),
        ]
    )
}
"""People who are here; Sam only watches."""


def gift(key, to):
    return Do(1, Op.GIVE, Drawn(Op.PRIMITIVE, key, ""), to=to)


def owner(board, key="p1/a"):
    return board.whole()["primitives"][key]["by"]


def test_who_is_given_a_shape_moves_it_and_the_giver_no_longer(board):
    board.do("p1", body("a", 1.0), now_ns=0, name="Ann")
    given = board.give("p1", gift("a", "p2"), here=HERE)
    assert (given.key, given.by, given.name, given.shape) == ("p1/a", "p2", "Ben", "box")
    assert (owner(board), places(board, "primitives")) == ("p2", {"p1/a": 1})
    with pytest.raises(OpError, match="Ben has it"):
        board.do("p1", body("a", 2.0), now_ns=1, name="Ann")
    board.do("p2", body("p1/a", 3.0), now_ns=2, name="Ben")
    assert places(board, "primitives") == {"p1/a": 3}
    board.give("p2", gift("p1/a", "p1"), here=HERE)
    board.do("p1", body("a", 4.0), now_ns=3, name="Ann")
    with pytest.raises(OpError, match="Ann has it"):
        board.do("p2", body("p1/a", 5.0), now_ns=4, name="Ben")


def test_of_two_hand_overs_the_first_counts(board):
    board.do("p1", body("a"), now_ns=0, name="Ann")
    board.give("p1", gift("a", "p2"), here=HERE)
    with pytest.raises(OpError, match="Ben has it"):
        board.give("p1", gift("a", "p3"), here=HERE)
    with pytest.raises(OpError, match="Ben has it"):
        board.give("p3", gift("p1/a", "p3"), here=HERE)
    assert owner(board) == "p2"
    # Nobody takes what somebody has who is here; what is left goes to whoever asks first.
    left = {key: person for key, person in HERE.items() if key != "p2"}
    with pytest.raises(OpError, match="Ben has it"):
        board.give("p3", gift("p1/a", "p1"), here=left)
    board.give("p3", gift("p1/a", "p3"), here=left)
    with pytest.raises(OpError, match="Cleo has it"):
        board.give("p1", gift("a", "p1"), here=left)
    assert owner(board) == "p3"


def test_nobody_undoes_what_they_have_given_away(board):
    board.do("p1", body("b", 7.0), now_ns=0)
    board.do("p1", body("a", 1.0), now_ns=1)
    board.do("p1", body("a", 2.0), now_ns=3 * STEADY_NS)
    board.give("p1", gift("a", "p2"), here=HERE)
    board.do("p2", body("p1/a", 3.0), now_ns=6 * STEADY_NS)
    assert board.do("p1", UNDO, now_ns=7 * STEADY_NS).key == "p1/b"
    assert places(board, "primitives") == {"p1/a": 3}
    # Nor does whoever got it undo more than what they did.
    board.do("p2", UNDO, now_ns=8 * STEADY_NS)
    assert (owner(board), places(board, "primitives")) == ("p2", {"p1/a": 2})
    with pytest.raises(OpError, match="nothing to undo"):
        board.do("p2", UNDO, now_ns=9 * STEADY_NS)


def test_what_a_maker_sends_late_does_not_make_a_removed_shape_anew(board):
    board.do("p1", body("a", 1.0), now_ns=0, name="Ann")
    board.give("p1", gift("a", "p2"), here=HERE)
    board.do("p2", body("p1/a", shape=None), now_ns=1, name="Ben")
    with pytest.raises(OpError, match="Ben has it"):
        board.do("p1", body("a", 2.0), now_ns=2, name="Ann")
    board.do("p2", UNDO, now_ns=3)
    assert (owner(board), places(board, "primitives")) == ("p2", {"p1/a": 1})


def test_a_shape_is_given_to_nobody_who_cannot_have_it(board):
    board.do("p1", body("a"), now_ns=0, name="Ann")
    for to, why in (("p4", "Sam only watches"), ("p9", "nobody of that name")):
        with pytest.raises(OpError, match=why):
            board.give("p1", gift("a", to), here=HERE)
    with pytest.raises(OpError, match="not there"):
        board.give("p1", gift("gone", "p2"), here=HERE)
    for number in range(MAX_PRIMITIVES_EACH):
        board.do("p2", body(f"n{number}"), now_ns=0, name="Ben")
    with pytest.raises(OpError, match=f"Ben has {MAX_PRIMITIVES_EACH}"):
        board.give("p1", gift("a", "p2"), here=HERE)
    assert owner(board) == "p1"


def test_whoever_has_no_page_yields_a_shape_unless_they_move_it(board):
    here = {**HERE, "hololens": Person("hololens", 9, "Ana", Role.LOCAL, is_yielding=True)}
    board.do("p1", body("a"), now_ns=0, name="Ann")
    board.give("p1", gift("a", "hololens"), here=here)
    assert owner(board) == "hololens"
    with pytest.raises(OpError, match="Ana has it"):
        board.give("p2", gift("p1/a", "p3"), here=here)
    now_ns = 10 * HOLD_NS
    board.do("hololens", body("p1/a", 5.0), now_ns=now_ns, name="Ana")
    take = gift("p1/a", "p2")
    with pytest.raises(OpError, match="Ana is moving it; wait until they let go"):
        board.give("p2", take, here=here, now_ns=now_ns + HOLD_NS - 1)
    board.give("p2", take, here=here, now_ns=now_ns + HOLD_NS)
    assert (owner(board), places(board, "primitives")["p1/a"]) == ("p2", 5)
    # The next owner's time begins anew: it can be handed on at once.
    board.do("p2", body("p1/a", 6.0), now_ns=now_ns + HOLD_NS, name="Ben")
    board.give("p2", gift("p1/a", "hololens"), here=here, now_ns=now_ns + HOLD_NS)
    board.give("p3", gift("p1/a", "p3"), here=here, now_ns=now_ns + HOLD_NS)
    assert owner(board) == "p3"
