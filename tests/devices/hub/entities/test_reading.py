"""Operations read field by field: what is wrong is refused, and said."""

import numpy as np
import pytest

from devices.hub.entities.reading import MAX_OBJECT_ID, read_drawn, read_key
from devices.hub.protocol.fields import MessageError
from devices.hub.roles import Op

BODY = {
    "primitive": "b",
    "shape": "sphere",
    "size": [0.3, 0.3, 0.3],
    "colour": [1, 0, 0],
    "pose": [0, 1, 0, 0, 0, 0, 1.05],
}
COPY = {"proposal": "c", "object": "chair-1", "pose": [0, 0, 0, 0, 0, 0, 1]}
SURFACE = {
    "surface": "s",
    "corners": [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]],
    "seen": [[0, 1, 1], [1, 1, 1], [1, 0, 1], [0, 0, 1]],
}


def test_a_primitive_is_read_and_its_quaternion_made_one():
    drawn = read_drawn(Op.PRIMITIVE, BODY)
    assert (drawn.key, drawn.shape, drawn.size_m) == ("b", "sphere", (0.3, 0.3, 0.3))
    np.testing.assert_allclose(drawn.room_from_entity.rotation, np.eye(3), atol=1e-12)
    np.testing.assert_array_equal(drawn.room_from_entity.translation, [0, 1, 0])


@pytest.mark.parametrize(
    ("op", "fields", "field"),
    [(Op.PRIMITIVE, BODY, "shape"), (Op.PROPOSE, COPY, "object"), (Op.SURFACE, SURFACE, "corners")],
)
def test_what_says_nothing_of_itself_is_erased(op, fields, field):
    rest = {name: value for name, value in fields.items() if name not in (field, "seen")}
    assert not read_drawn(op, rest).is_there
    assert not read_drawn(op, {**rest, field: None}).is_there


def test_a_carried_surface_is_filmed_at_one_place_and_seen_at_another():
    drawn = read_drawn(Op.SURFACE, SURFACE)
    np.testing.assert_array_equal(drawn.points, SURFACE["corners"])
    np.testing.assert_array_equal(drawn.seen, SURFACE["seen"])
    assert len(read_drawn(Op.SURFACE, {**SURFACE, "seen": []}).seen) == 0


@pytest.mark.parametrize(
    ("op", "fields", "changed"),
    [
        (Op.PRIMITIVE, BODY, {"shape": "teapot"}),
        (Op.PRIMITIVE, BODY, {"shape": ["box"]}),
        (Op.PRIMITIVE, BODY, {"size": [0.3, 0.3]}),
        (Op.PRIMITIVE, BODY, {"size": [0.3, 0.3, 0.001]}),
        (Op.PRIMITIVE, BODY, {"size": [0.3, 3.1, 0.3]}),
        (Op.PRIMITIVE, BODY, {"size": None}),
        (Op.PRIMITIVE, BODY, {"colour": [2, 0, 0]}),
        (Op.PRIMITIVE, BODY, {"pose": [0, 0, 0, 0, 0, 0, 0]}),
        (Op.PRIMITIVE, BODY, {"pose": [0, 0, 0, 0, 0, 0, 1.2]}),
        (Op.PRIMITIVE, BODY, {"pose": [0, 0, 101, 0, 0, 0, 1]}),
        (Op.PRIMITIVE, BODY, {"pose": [0, 0, 0, 0, 0, 0, float("nan")]}),
        (Op.PRIMITIVE, BODY, {"pose": [0, 0, 0, 0, 0, 1]}),
        (Op.PRIMITIVE, BODY, {"primitive": "a b"}),
        (Op.PROPOSE, COPY, {"object": ""}),
        (Op.PROPOSE, COPY, {"object": "x" * (MAX_OBJECT_ID + 1)}),
        (Op.PROPOSE, COPY, {"object": 4}),
        (Op.PROPOSE, COPY, {"pose": None}),
        (Op.SURFACE, SURFACE, {"seen": [[0, 0, 0]] * 4}),
        (Op.SURFACE, SURFACE, {"seen": [[0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0]]}),
        (Op.SURFACE, SURFACE, {"seen": [[0, 0, 0]] * 3}),
        (Op.SURFACE, SURFACE, {"seen": {"a": 1}}),
        (Op.SURFACE, SURFACE, {"corners": []}),
    ],
)
def test_a_field_that_is_wrong_is_named(op, fields, changed):
    with pytest.raises(MessageError, match="seen" if "corners" in changed else next(iter(changed))):
        read_drawn(op, {**fields, **changed})


def test_a_name_is_short():
    assert read_key({"line": "p1/a"}, "line") == "p1/a"
    with pytest.raises(MessageError, match="line"):
        read_key({"line": "x" * 41}, "line")


def test_a_line_may_be_on_an_object():
    line = {"line": "a", "points": [[0, 1, 0], [0, 1, 1]], "colour": [1, 0, 0]}
    assert read_drawn(Op.LINE, line).object_id == ""
    on = read_drawn(Op.LINE, {**line, "on": "chair-1", "at": [1, 0, 2, 0, 0, 0, 1]})
    assert on.object_id == "chair-1"
    np.testing.assert_array_equal(on.room_from_entity.translation, [1, 0, 2])
    assert not read_drawn(Op.LINE, {"line": "a", "on": "chair-1"}).is_there
    for wrong in ({"on": "chair-1"}, {"on": 3, "at": [0] * 7}, {"on": "chair-1", "at": [0] * 7}):
        with pytest.raises(MessageError, match=r"at:|on:"):
            read_drawn(Op.LINE, {**line, **wrong})
