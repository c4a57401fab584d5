"""Rights of people: who may draw while one person has the pen."""

import pytest

from devices.hub.roles import Op, Pen, Person, Role, can_hold_pen

ANN = Person("p1", 1, "Ann", Role.REMOTE)
BEN = Person("p2", 2, "Ben", Role.LOCAL)
EVE = Person("p3", 3, "Eve", Role.SPECTATOR)


def test_everybody_draws_until_one_has_the_pen():
    pen = Pen()
    assert Op.PROPOSE in pen.rights(ANN)
    assert pen.refusal(BEN, Op.LINE) == ""
    pen.holder = "p1"
    assert pen.rights(ANN) == sorted(Op)
    assert pen.rights(BEN) == []
    assert pen.refusal(BEN, Op.UNDO) == "somebody else has the pen"
    assert pen.refusal(ANN, Op.LINE) == ""


@pytest.mark.parametrize("op", list(Op))
def test_a_spectator_and_who_is_muted_do_nothing(op):
    pen = Pen("p3")
    assert "may not" in pen.refusal(EVE, op)
    muted = Person("p3", 3, "Eve", Role.REMOTE, is_muted=True)
    assert pen.refusal(muted, op) == "you are muted"
    assert pen.rights(muted) == []


def test_the_pen_is_of_no_use_to_a_spectator():
    assert can_hold_pen(ANN)
    assert not can_hold_pen(EVE)
