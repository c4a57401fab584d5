"""Bodies on the wire: what goes in comes out, and hostile bytes are refused."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.hub.protocol.wire import (
    ALL_FLAGS,
    JOINTS,
    MAX_BODY_BYTES,
    Body,
    Controller,
    Hand,
    WireError,
    check_body,
    decode_body,
    encode_body,
    head_only,
    pack_bodies,
    unpack_bodies,
)
from scenes.pose import Pose, rotation_angle

metres = st.floats(-60, 60, width=32)
places = st.tuples(metres, metres, metres)


@st.composite
def poses(draw):
    seed = draw(st.integers(0, 2**32 - 1))
    q = np.random.default_rng(seed).normal(size=4)
    return Pose.from_quaternion(q / np.linalg.norm(q), draw(places))


@st.composite
def hands(draw):
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    joints = np.array(draw(places)) + random.uniform(-0.3, 0.3, (JOINTS, 3))
    return Hand(joints, random.uniform(0, 0.05, JOINTS))


controllers = st.builds(
    Controller,
    poses(),
    poses(),
    st.integers(0, 0xFFFF),
    st.tuples(*[st.floats(-1, 1)] * 4),
)
bodies = st.builds(
    Body,
    seq=st.integers(0, 2**32 - 1),
    t_us=st.integers(0, 2**64 - 1),
    room_from_head=st.none() | poses(),
    controllers=st.tuples(st.none() | controllers, st.none() | controllers),
    hands=st.tuples(st.none() | hands(), st.none() | hands()),
    ray=st.none() | st.tuples(places, places).map(np.array),
)


def assert_near(a, b):
    assert (a is None) == (b is None)
    if a is not None:
        np.testing.assert_allclose(a.translation, b.translation, atol=1e-5)
        assert rotation_angle(a.rotation.T @ b.rotation) < 1e-5


def whole():
    pose = Pose.from_yaw(0.3, (1, 2, 3))
    hand = Hand(np.full((JOINTS, 3), 1.0), np.full(JOINTS, 0.01))
    controller = Controller(pose, pose, 3, (0.5, -1.0, 0.0, 1.0))
    return encode_body(Body(7, 8, pose, (controller,) * 2, (hand,) * 2, np.zeros((2, 3))))


@given(bodies)
def test_a_body_comes_back(body):
    data = encode_body(body)
    back = decode_body(data)
    assert len(data) <= MAX_BODY_BYTES
    assert (back.seq, back.t_us) == (body.seq, body.t_us) == (check_body(data), body.t_us)
    assert_near(back.room_from_head, body.room_from_head)
    for a, b in zip(back.controllers, body.controllers, strict=True):
        assert (a is None) == (b is None)
        if a is not None:
            assert_near(a.room_from_aim, b.room_from_aim)
            assert_near(a.room_from_grip, b.room_from_grip)
            assert a.buttons == b.buttons
            assert a.axes == pytest.approx(b.axes, abs=2e-5)
    for a, b in zip(back.hands, body.hands, strict=True):
        assert (a is None) == (b is None)
        if a is not None:
            np.testing.assert_allclose(a.joints, b.joints, atol=6e-4)
            np.testing.assert_allclose(a.radii_m, b.radii_m, atol=6e-4)
    assert (back.ray is None) == (body.ray is None)
    if body.ray is not None:
        np.testing.assert_allclose(back.ray, body.ray, atol=1e-5)


def test_the_layout_is_that_of_the_page():
    data = encode_body(Body(5, 6, Pose.from_quaternion((1, 0, 0, 0), (1, 2, 3))))
    assert data == struct.pack("<BBHIQ7f", 1, 1, 1, 5, 6, 1, 2, 3, 0, 0, 0, 1)
    assert len(whole()) == MAX_BODY_BYTES


def test_a_body_cut_at_any_byte_or_grown_is_refused():
    data = whole()
    for at in range(len(data)):
        with pytest.raises(WireError):
            check_body(data[:at])
        with pytest.raises(WireError):
            decode_body(data[:at])
    with pytest.raises(WireError, match="575 bytes, wanted 574"):
        check_body(data + b"\0")


@given(st.binary(max_size=700))
def test_random_bytes_are_refused(data):
    with pytest.raises(WireError):
        decode_body(data)


@given(st.integers(0, ALL_FLAGS), st.data())
def test_random_contents_are_read_or_refused(flags, draw):
    """With a header that is right: what `check_body` lets through, `decode_body` reads."""
    body = draw.draw(st.binary(min_size=558, max_size=558))
    for length in (0, 28, 66, 187, 24, 28 + 66, 28 + 187 * 2, 558):
        data = struct.pack("<BBHIQ", 1, 1, flags, 1, 2) + body[:length]
        try:
            check_body(data)
        except WireError:
            with pytest.raises(WireError):
                decode_body(data)
        else:
            decode_body(data)


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf"), 100.01, -1e30])
@pytest.mark.parametrize("at", range(4))
def test_numbers_out_of_the_room_are_refused(number, at):
    data = bytearray(encode_body(Body(1, 2, Pose.identity())))
    struct.pack_into("<f", data, 16 + 4 * at, number)
    with pytest.raises(WireError, match="body 1"):
        check_body(bytes(data))


def test_what_is_no_turn_is_refused():
    data = bytearray(encode_body(Body(1, 2, Pose.identity())))
    struct.pack_into("<f", data, 16 + 24, 0.5)
    with pytest.raises(WireError, match=r"norm 0\.5"):
        check_body(bytes(data))


@pytest.mark.parametrize(("at", "value"), [(0, 2), (1, 2), (2, 65), (3, 1)])
def test_another_version_kind_or_flag_is_refused(at, value):
    data = bytearray(encode_body(Body(1, 2, Pose.identity())))
    data[at] = value
    with pytest.raises(WireError):
        check_body(bytes(data))


@pytest.mark.parametrize(
    "body",
    [
        Body(-1, 0, None),
        Body(0, 2**64, None),
        Body(0, 0, Pose.from_yaw(0, (101, 0, 0))),
        Body(0, 0, None, ray=np.array([[0, 0, np.nan], [0, 0, 0]])),
        Body(0, 0, None, hands=(Hand(np.zeros((26, 3)), np.zeros(26)), None)),
        Body(0, 0, None, hands=(Hand(np.zeros((25, 3)), np.full(25, 0.3)), None)),
        Body(0, 0, None, hands=(Hand(np.full((25, 3), np.nan), np.zeros(25)), None)),
        Body(0, 0, None, (Controller(Pose.identity(), Pose.identity(), 1 << 16), None)),
        Body(
            0,
            0,
            None,
            (Controller(Pose.identity(), Pose.identity(), 0, (0, 0, 0, float("nan"))), None),
        ),
    ],
)
def test_what_does_not_fit_is_not_sent(body):
    with pytest.raises(WireError), np.errstate(invalid="ignore"):
        encode_body(body)


def test_a_head_is_cut_out():
    body = decode_body(head_only(whole()))
    assert body.seq == 7
    assert body.room_from_head is not None
    assert body.controllers == body.hands == (None, None)
    assert body.ray is None
    assert len(head_only(encode_body(Body(1, 2, None)))) == 16


@given(st.lists(st.tuples(st.integers(0, 0xFFFF), st.binary(max_size=574)), max_size=5))
def test_bundles_come_back(items):
    data = pack_bodies(items)
    assert list(unpack_bodies(data)) == items
    for at in range(len(data)):
        with pytest.raises(WireError):
            unpack_bodies(data[:at])
    with pytest.raises(WireError):
        unpack_bodies(data + b"\0")


@given(st.binary(max_size=80))
def test_random_bundles_are_read_or_refused(data):
    for tail in (data, struct.pack("<BB", 1, 2) + data):
        try:
            assert pack_bodies(unpack_bodies(tail)) == tail
        except WireError:
            continue


def test_a_bundle_holds_what_u16_counts():
    with pytest.raises(WireError):
        pack_bodies([(0x10000, b"")])
    with pytest.raises(WireError):
        pack_bodies([(1, bytes(0x10000))])
