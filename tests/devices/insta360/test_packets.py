import struct
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.insta360.errors import CameraProtocolError
from devices.insta360.packets import (
    MAX_PACKET_BYTES,
    VIDEO,
    KeepAlive,
    Message,
    PacketParser,
    Stream,
    Sync,
    Unknown,
    encode,
)

packets = st.one_of(
    st.just(Sync()),
    st.just(KeepAlive()),
    st.builds(
        Message,
        code=st.integers(0, 0xFFFF),
        seq=st.integers(0, 0xFFFFFF),
        body=st.binary(max_size=40),
    ),
    st.builds(
        Stream,
        channel=st.integers(0, 255),
        stamp=st.integers(0, (1 << 64) - 1),
        data=st.binary(max_size=200),
    ),
    st.builds(Unknown, kind=st.sampled_from((0, 2, 3, 7, 255)), data=st.binary(max_size=40)),
)


def pieces(data, cuts):
    places = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    return [data[a:b] for a, b in pairwise(places)]


def test_bytes_are_those_that_cameras_and_apps_send():
    """From the published description of the protocol, not from our encoder."""
    assert encode(Sync()) == bytes.fromhex("11000000 060000") + b"syNceNdinS"
    assert encode(KeepAlive()) == bytes.fromhex("07000000 050000")
    assert encode(Message(8, 0x010203, b"\x08\x30")) == bytes.fromhex(
        "12000000 040000 0800 02 030201 800000 0830"
    )
    assert encode(Stream(VIDEO, 0x0102, b"xy")) == bytes.fromhex(
        "12000000 010000 20 0201000000000000 7879"
    )


def test_a_real_error_and_a_real_notification_are_read():
    """As recorded from a ONE RS; flags of notifications differ."""
    busy = bytes.fromhex("040000f4010203000080000012") + b"\x0fcamera is busy."
    state = bytes.fromhex("040000102002ff8a43f40000080110001a00")
    wire = b"".join(struct.pack("<I", len(p) + 4) + p for p in (busy, state))
    error, notice = PacketParser().feed(wire)
    assert (error.code, error.seq, error.body[2:]) == (500, 3, b"camera is busy.")
    assert (notice.code, notice.seq, notice.body) == (8208, 0x438AFF, b"\x08\x01\x10\x00\x1a\x00")


@given(st.lists(packets, max_size=8), st.lists(st.integers(0, 4000), max_size=30))
def test_any_split_of_the_stream_gives_the_same_packets(sent, cuts):
    wire = b"".join(encode(packet) for packet in sent)
    parser = PacketParser()
    read = [packet for piece in pieces(wire, cuts) for packet in parser.feed(piece)]
    assert read == sent
    assert parser.held_bytes == 0


@given(packets, st.data())
def test_a_packet_that_is_not_whole_is_held_and_nothing_more(packet, data):
    wire = encode(packet)
    kept = data.draw(st.integers(0, len(wire) - 1))
    parser = PacketParser()
    assert parser.feed(wire[:kept]) == []
    assert parser.held_bytes == kept
    assert parser.feed(wire[kept:]) == [packet]


@pytest.mark.parametrize("size", [0, 1, 6, MAX_PACKET_BYTES + 1, (1 << 32) - 1])
def test_a_length_that_cannot_be_is_refused_before_anything_is_kept_for_it(size):
    with pytest.raises(CameraProtocolError, match=f"packet of {size} bytes, wanted 7 to 4194304"):
        PacketParser().feed(struct.pack("<I", size))


@pytest.mark.parametrize(
    ("payload", "says"),
    [
        (b"\x01\0\0" + bytes(8), "stream packet with 8 bytes, wanted at least 9"),
        (b"\x04\0\0" + bytes(8), "message packet with 8 bytes, wanted at least 9"),
        (b"\x06\0\0UCD2", "handshake b'UCD2'"),
    ],
)
def test_a_packet_too_short_for_its_kind_is_refused(payload, says):
    with pytest.raises(CameraProtocolError, match=says):
        PacketParser().feed(struct.pack("<I", len(payload) + 4) + payload)


def test_the_largest_packet_passes_and_a_larger_one_is_not_sent():
    room = MAX_PACKET_BYTES - len(encode(Stream(VIDEO, 0, b"")))
    packet = Stream(VIDEO, 0, bytes(room))
    assert PacketParser().feed(encode(packet)) == [packet]
    with pytest.raises(CameraProtocolError, match="at most 4194304"):
        encode(Stream(VIDEO, 0, bytes(room + 1)))
