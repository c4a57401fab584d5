"""Texts of people: each is read, or refused with the field that is wrong."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.hub.entities.reading import MAX_POINTS, MAX_SIDE_M
from devices.hub.protocol.fields import MessageError, read_object
from devices.hub.protocol.messages import (
    MAX_MODEL,
    MAX_NAME,
    DeviceSaid,
    Do,
    Hello,
    Immersion,
    OpError,
    Ping,
    Seen,
    clean_name,
    read_device,
    read_message,
)
from devices.hub.roles import Op

SAID = {
    "kind": "device",
    "model": "Quest 3",
    "immersion": "vr",
    "worn": True,
    "hz": 71.9,
    "battery": 62,
    "charging": False,
}

LINE = {
    "kind": "do",
    "id": 4,
    "op": "line",
    "line": "a-1",
    "points": [[0, 1, 2.5], [3, 4, 5]],
    "colour": [1, 0.5, 0],
}
SURFACE = {
    "kind": "do",
    "id": "s",
    "op": "surface",
    "surface": "tv",
    "corners": [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]],
}
SEEN = {
    **SURFACE,
    "seen": [[0, 2, 0], [1, 2, 0], [1, 1, 0], [0, 1, 0]],
    "drag": 12,
}
PRIMITIVE = {
    "kind": "do",
    "id": 5,
    "op": "primitive",
    "primitive": "b-1",
    "shape": "cylinder",
    "size": [0.5, 1, 0.02],
    "colour": [1, 0.5, 0],
    "pose": [0, 0, -1.5, 0, 1, 0, 0],
    "drag": "g1",
}
PROPOSE = {
    "kind": "do",
    "id": 6,
    "op": "propose",
    "proposal": "c-1",
    "object": "chair-1",
    "pose": [1, 0, 2, 0, 0, 0, 1],
}
GIVE = {"kind": "do", "id": 7, "op": "give", "primitive": "p1/b-1", "to": "p2"}
VALID = (
    {"kind": "hello", "token": "t", "name": "Anna", "log_seq": 3},
    {"kind": "seen", "version": 3},
    {"kind": "ping", "t_us": 12.5},
    LINE,
    SURFACE,
    {"kind": "do", "id": 1, "op": "undo"},
    SEEN,
    PRIMITIVE,
    PROPOSE,
    GIVE,
)
BIG = 10**400


def read(fields):
    return read_message(json.dumps(fields))


def test_each_kind_is_read():
    assert read(VALID[0]) == Hello("t", "Anna", 3)
    assert read({"kind": "hello", "token": "t"}) == Hello("t", None, None)
    assert read(VALID[1]) == Seen(3)
    assert read(VALID[2]) == Ping(12.5)
    line, surface, undo = (read(fields) for fields in VALID[3:6])
    assert (line.op_id, line.op, line.drag) == (4, Op.LINE, None)
    assert (line.drawn.key, line.drawn.colour) == ("a-1", (1.0, 0.5, 0.0))
    np.testing.assert_array_equal(line.drawn.points, LINE["points"])
    assert (surface.op_id, surface.op, surface.drawn.points.shape) == ("s", Op.SURFACE, (4, 3))
    assert (undo.op, undo.drawn) == (Op.UNDO, None)
    assert read(SEEN).drag == 12
    given = read(GIVE)
    assert (given.op, given.drawn.key, given.to) == (Op.GIVE, "p1/b-1", "p2")


@pytest.mark.parametrize("points", [[], None])
def test_no_points_erase(points):
    assert read({**LINE, "points": points}).drawn.points.shape == (0, 3)
    assert read({**SURFACE, "corners": points}).drawn.points.shape == (0, 3)


def test_a_kind_of_later_is_ignored():
    assert read({"kind": "dance", "x": 1}) is None


@pytest.mark.parametrize("fields", VALID, ids=lambda f: f"{f['kind']} {f.get('op', '')}")
def test_a_message_cut_at_any_byte_is_refused(fields):
    text = json.dumps(fields)
    for at in range(len(text)):
        with pytest.raises(MessageError):
            read_message(text[:at])


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=8,
)


@given(st.sampled_from(VALID), st.data())
def test_any_value_in_any_field_is_read_or_refused(fields, draw):
    field = draw.draw(st.sampled_from(sorted(fields)))
    text = json.dumps({**fields, field: draw.draw(anything)})
    try:
        message = read_message(text)
    except (MessageError, OpError):
        return
    if isinstance(message, Do) and message.drawn is not None:
        assert np.all(np.abs(message.drawn.points) <= 100)
        assert message.drawn.is_finite
        assert max(message.drawn.size_m) <= MAX_SIDE_M


@given(st.text())
def test_any_text_is_read_or_refused(text):
    try:
        read_message(text)
    except (MessageError, OpError):
        return


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"kind":' * 20_000,
        '{"kind":"seen","version":' + "9" * 5000 + "}",
        '{"kind":"ping","t_us":NaN}',
        '{"kind":"ping","t_us":1e999}',
        '{"kind":"ping","t_us":true}',
        '{"kind":"ping"}',
        '{"kind":"seen","version":-1}',
        '{"kind":"seen","version":1.5}',
        '{"kind":"hello"}',
        '{"kind":"hello","token":5}',
        '{"kind":5}',
        "[]",
        "null",
        "",
    ],
    ids=lambda text: text[:30],
)
def test_hostile_texts_are_refused(text):
    with pytest.raises(MessageError) as caught:
        read_message(text)
    assert len(str(caught.value)) < 100


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("op", "fly"),
        ("line", ""),
        ("line", "a" * 41),
        ("line", "a/b/c"),
        ("line", "<b>"),
        ("points", 5),
        ("points", [[0, 0]]),
        ("points", [5]),
        ("points", [[0, 0, "x"]]),
        ("points", [[0, 0, 101]]),
        ("points", [[0, 0, BIG]]),
        ("points", [[0, 0, 0]] * (MAX_POINTS + 1)),
        ("colour", [1, 1]),
        ("colour", [1, 1, 2]),
        ("colour", "red"),
    ],
)
def test_an_operation_that_is_wrong_is_refused_by_name(field, value):
    with pytest.raises(OpError) as caught:
        read({**LINE, field: value})
    assert caught.value.op_id == 4


@pytest.mark.parametrize("corners", [[[0, 0, 0]] * 3, [[0, 0, 0]] * 5, "x", {"a": 1}, 5])
def test_a_surface_has_four_corners(corners):
    with pytest.raises(OpError):
        read({**SURFACE, "corners": corners})


@pytest.mark.parametrize("op_id", [None, "", "a" * 41, 1.5, True, [1], BIG])
def test_an_operation_without_a_name_is_refused(op_id):
    with pytest.raises(MessageError):
        read({**LINE, "id": op_id})


def test_names_can_be_shown_and_logged():
    assert clean_name("  Anna\n\tMaria\x00 ") == "Anna Maria"
    assert clean_name("\x1b[31mred") == "[31mred"
    assert len(clean_name("x" * 10_000)) == MAX_NAME
    assert clean_name("\u202e\n") == "somebody"
    with pytest.raises(MessageError):
        clean_name(5)


def test_an_object_may_be_bytes():
    assert read_object(b'{"a":1}') == {"a": 1}
    with pytest.raises(MessageError):
        read_object(b"\xff\xfe\xfa")


def test_a_headset_is_read_as_it_is_said():
    assert read_device(SAID) == DeviceSaid("Quest 3", Immersion.VR, True, 71.9, 62.0, False)
    least = read_device({"kind": "device", "immersion": "none", "hz": None, "battery": None})
    assert least == DeviceSaid("", Immersion.NONE, False, None, None, False)
    assert (
        read_device({**SAID, "model": "\x1b<b>" + 99 * "x"}).model == "<b>" + (MAX_MODEL - 4) * "x"
    )


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("model", 3),
        ("immersion", "mr"),
        ("immersion", None),
        ("worn", 1),
        ("hz", -1),
        ("hz", 1e9),
        ("hz", float("nan")),
        ("battery", 101),
        ("battery", "full"),
        ("charging", "yes"),
    ],
)
def test_what_cannot_be_is_refused_with_what_is_wanted(field, value):
    with pytest.raises(MessageError, match=field):
        read_device({**SAID, field: value})
