"""Doings of simulated people: everything they ask for is what a hub takes."""

import json
from itertools import islice

import numpy as np
import pytest

from devices.hub.entities.board import Board
from devices.hub.protocol.messages import Do, read_message
from sim.headset.doings import doings

RIGHTS = ("line", "primitive", "propose", "surface", "undo")
TIPS = np.array([[0.1 * step, 1.0, -0.5] for step in range(6)])


def sent(doing):
    """Its messages as a hub reads them, the end last."""
    asked = [*(doing.step(tip) for tip in TIPS), doing.end()]
    return [read_message(json.dumps({"kind": "do", "id": 1, **message})) for message in asked]


@pytest.mark.parametrize("seed", [0, 16])
def test_all_kinds_are_done_in_turn_and_taken_away_again(seed):
    board, seen = Board(), []
    for number, doing in enumerate(islice(doings(RIGHTS, ("chair-1", "stool-1"), seed=seed), 8)):
        messages = sent(doing)
        assert all(isinstance(message, Do) for message in messages)
        drawn = [
            board.do("p1", message, now_ns=number * 10**10 + step)
            for step, message in enumerate(messages)
        ]
        assert all(it.is_there for it in drawn[:-1])
        assert not drawn[-1].is_there
        seen.append(doing.op)
    assert set(seen[:4]) == {"line", "primitive", "propose", "surface"}
    assert seen[:4] == seen[4:]
    assert not any(board.whole().values())


def test_a_picture_is_carried_away_from_where_it_is_filmed():
    (picture,) = islice(doings(("surface",), (), seed=0), 1)
    first, *_, last = (picture.step(tip) for tip in TIPS)
    assert "seen" not in first
    assert last["corners"] == first["corners"]
    assert last["seen"][0][1] > last["corners"][0][1] + 0.2


def test_nobody_does_what_they_may_not():
    assert list(doings((), ("chair-1",), seed=0)) == []
    kinds = {doing.op for doing in islice(doings(("line", "primitive", "propose"), (), seed=0), 6)}
    assert kinds == {"line"}
    few = {doing.op for doing in islice(doings(RIGHTS, ("chair-1",), seed=5), 8)}
    assert few == {"line", "primitive"}, "a crowd does not fill a room with pictures and copies"
