"""Shapes that people hand to each other in a session, and what somebody has left."""

from devices.hub.attendance import AWAY_NS
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
