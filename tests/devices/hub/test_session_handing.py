"""Shapes that people hand to each other in a session, and what somebody has left."""

from dataclasses import replace

import pytest

from devices.hub.attendance import AWAY_NS
from devices.hub.elsewhere import Elsewhere
from devices.hub.entities.board import HOLD_NS
from devices.hub.entities.drawn import drawn_entity
from devices.hub.protocol.messages import Do, OpError
from devices.hub.roles import Op, Person, Role
from devices.hub.session import Visit

BOX = {
    "kind": "do",
    "id": 1,
    "op": "primitive",
    "primitive": "a",
    "shape": "box",
    "size": [0.3, 0.3, 0.3],
    "pose": [1, 0, 0, 0, 0, 0, 1],
}


def of_the_log(room, outbox):
    return [it for it in room.drain(outbox) if it["kind"] in ("log", "done", "refused")]


def test_everybody_learns_whose_a_shape_is_that_is_handed_over(room):
    anna, hers, _ = room.join("Anna")
    ben, his, _ = room.join("Ben")
    room.hear(anna, hers, **BOX)
    of_the_log(room, hers), of_the_log(room, his)
    assert room.hear(anna, hers, kind="do", id=2, op="give", primitive="p1/a", to="p2")
    (log, done), (his_log,) = of_the_log(room, hers), of_the_log(room, his)
    assert log == his_log
    assert (log["op"], log["primitive"], log["by"], log["shape"]) == (
        "primitive",
        "p1/a",
        "p2",
        "box",
    )
    assert done == {"kind": "done", "id": 2}
    # Both move it at once: what the hub takes is everybody's.
    room.hear(anna, hers, **{**BOX, "id": 3, "pose": [2, 0, 0, 0, 0, 0, 1]})
    room.hear(ben, his, **{**BOX, "primitive": "p1/a", "pose": [3, 0, 0, 0, 0, 0, 1]})
    refused, log = of_the_log(room, hers)
    assert refused == {"kind": "refused", "id": 3, "why": "Ben has it"}
    assert (log["by"], log["pose"][0]) == ("p2", 3.0)
    assert of_the_log(room, his)[0] == log
    arrived = room.session.take()
    (placed,) = arrived.placed
    assert (placed.primitive_id, placed.user_id) == ("p1/a", "p2")
    assert ("given", "Anna (p1) gave p1/a to Ben") in arrived.events
    _cleo, _outbox, welcome = room.join("Cleo")
    assert welcome["state"]["primitives"]["p1/a"]["by"] == "p2"


def test_what_somebody_has_left_is_taken_by_whoever_asks_first(room):
    anna, hers, _ = room.join("Anna")
    ben, his, _ = room.join("Ben")
    cleo, cleos, _ = room.join("Cleo")
    room.hear(anna, hers, **BOX)
    take = {"kind": "do", "id": 1, "op": "give", "primitive": "p1/a"}
    room.session.leave(Visit(anna, hers), room.now_ns)
    room.hear(ben, his, **take, to="p2")
    assert of_the_log(room, his)[-1]["why"] == "Anna has it", "she may come back"
    room.now_ns += AWAY_NS
    room.hear(cleo, cleos, **take, to="p3")
    room.hear(ben, his, **take, to="p2")
    assert of_the_log(room, cleos)[-1]["kind"] == "done"
    assert of_the_log(room, his)[-1]["why"] == "Cleo has it"


def test_a_headsets_wearer_has_what_they_are_given_until_somebody_asks_for_it(room):
    wearer = Person("hololens", 0, "Ana", Role.LOCAL, is_yielding=True)
    anna, hers, _ = room.join("Anna")
    ben, his, _ = room.join("Ben")
    room.session.meet([Elsewhere(wearer, b"")], room.now_ns, way="hololens")
    people = [m for m in room.drain(his) if m.get("kind") == "people"][-1]["people"]
    assert [(p["takes"], p["yields"]) for p in people] == [
        (True, False),
        (True, False),
        (True, True),
    ]
    room.hear(anna, hers, **BOX)
    room.hear(anna, hers, kind="do", id=2, op="give", primitive="p1/a", to="hololens")
    assert [it.get("by") for it in of_the_log(room, his)] == ["p1", "hololens"]
    (placed,) = room.session.take().placed
    assert placed.user_id == "hololens"
    # Their hand moves it, and nobody takes it from it; then Ben asks.
    moved = replace(drawn_entity(placed), size_m=(0.5, 0.3, 0.3))
    room.session.act("hololens", Do(1, Op.PRIMITIVE, moved), now_ns=room.now_ns)
    take = {"kind": "do", "id": 1, "op": "give", "primitive": "p1/a", "to": "p2"}
    room.hear(ben, his, **take)
    log, refused = of_the_log(room, his)
    assert (log["by"], log["size"][0]) == ("hololens", 0.5)
    assert refused["why"] == "Ana is moving it; wait until they let go"
    room.now_ns += HOLD_NS
    room.hear(ben, his, **take)
    assert [it["kind"] for it in of_the_log(room, his)] == ["log", "done"]
    with pytest.raises(OpError, match="Ben has it"):
        room.session.act("hololens", Do(2, Op.PRIMITIVE, moved), now_ns=room.now_ns)
    with pytest.raises(KeyError, match="north"):
        room.session.act("north.p1", Do(2, Op.PRIMITIVE, moved), now_ns=room.now_ns)


def test_what_a_wearer_who_has_gone_has_left_is_taken(room):
    wearer = Person("hololens", 0, "Ana", Role.LOCAL)
    anna, hers, _ = room.join("Anna")
    room.session.meet([Elsewhere(wearer, b"")], room.now_ns, way="hololens")
    room.hear(anna, hers, **BOX)
    give = {"kind": "do", "id": 2, "op": "give", "primitive": "p1/a"}
    room.hear(anna, hers, **give, to="hololens")
    room.hear(anna, hers, **give, to="p1")
    room.session.meet([], room.now_ns, way="hololens")
    room.hear(anna, hers, **give, to="hololens")
    room.hear(anna, hers, **give, to="p1")
    whys = [it["why"] for it in of_the_log(room, hers) if it["kind"] == "refused"]
    assert whys == ["Ana has it", "Ana has it"]
    assert [it.user_id for it in room.session.take().placed] == ["p1"]
