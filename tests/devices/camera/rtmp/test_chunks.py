import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera.rtmp.chunks import (
    MAX_CHUNK_STREAMS,
    MAX_COMMAND_BYTES,
    ChunkReader,
    RtmpError,
    encode_message,
)


@given(
    st.lists(
        st.tuples(st.sampled_from([8, 9, 20]), st.binary(max_size=700), st.integers(2, 6)),
        max_size=6,
    ),
    st.integers(1, 300),
)
def test_messages_come_back_however_they_arrive(messages, step):
    data = b"".join(
        encode_message(kind, body, channel=channel, stream=1, chunk_bytes=128)
        for kind, body, channel in messages
    )
    reader = ChunkReader()
    read = [m for at in range(0, len(data), step) for m in reader.take(data[at : at + step])]
    assert [(m.kind, m.data, m.stream) for m in read] == [(k, b, 1) for k, b, _ in messages]


def test_a_chunk_size_that_is_announced_is_used():
    body = bytes(range(256)) * 4
    data = encode_message(1, (1000).to_bytes(4, "big"), chunk_bytes=128)
    data += encode_message(9, body, chunk_bytes=1000)
    assert ChunkReader().take(data)[1].data == body


def test_short_headers_keep_what_they_leave_out():
    whole = b"\x04\x00\x03\xe8\x00\x00\x02\x09\x01\x00\x00\x00ab"
    same_stream = b"\x44\x00\x00\x21\x00\x00\x01\x09c"
    only_time = b"\x84\x00\x00\x05d"
    nothing = b"\xc4e"
    read = ChunkReader().take(whole + same_stream + only_time + nothing)
    assert [(m.time_ms, m.data) for m in read] == [
        (1000, b"ab"),
        (1033, b"c"),
        (1038, b"d"),
        (1043, b"e"),
    ]


def test_a_time_beyond_three_bytes_is_read():
    data = b"\x04\xff\xff\xff\x00\x00\x01\x09\x01\x00\x00\x00\x01\x02\x03\x04x"
    assert ChunkReader().take(data)[0].time_ms == 0x01020304


def test_messages_of_several_streams_may_interleave():
    first = encode_message(9, b"v" * 200, channel=4, chunk_bytes=128)
    second = encode_message(8, b"a", channel=5, chunk_bytes=128)
    cut = 12 + 128
    read = ChunkReader().take(first[:cut] + second + first[cut:])
    assert [m.data for m in read] == [b"a", b"v" * 200]


def test_a_chunk_stream_may_begin_with_a_header_that_leaves_out_the_message_stream():
    data = b"\x46" + (40).to_bytes(3, "big") + (3).to_bytes(3, "big") + b"\x09" + b"abc"
    (read,) = ChunkReader().take(data)
    assert (read.kind, read.stream, read.time_ms, read.data) == (9, 0, 40, b"abc")


def test_an_aborted_message_leaves_no_bytes():
    first = encode_message(9, b"v" * 200, channel=4, chunk_bytes=128)
    abort = encode_message(2, (4).to_bytes(4, "big"), channel=2, chunk_bytes=128)
    again = encode_message(9, b"w" * 20, channel=4, chunk_bytes=128)
    read = ChunkReader().take(first[: 12 + 128] + abort + again)
    assert [m.data for m in read if m.kind == 9] == [b"w" * 20]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\x04\x00\x00\x00\xff\xff\xff\x09\x01\x00\x00\x00", "a message of 16777215 bytes"),
        (b"\xc4abc", "begins without a length"),
        (b"\x84\x00\x00\x00", "begins without a length"),
        (encode_message(1, bytes(4), chunk_bytes=128), "chunk size 0"),
        (
            b"".join(bytes([n]) + bytes(11) for n in range(2, 4 + MAX_CHUNK_STREAMS)),
            "chunk streams",
        ),
    ],
)
def test_lengths_that_cannot_be_are_refused(data, said):
    with pytest.raises(RtmpError, match=said):
        ChunkReader().take(data)


def test_partial_messages_are_bounded_in_sum():
    size = MAX_COMMAND_BYTES.to_bytes(3, "big")
    reader = ChunkReader()
    reader.take(encode_message(1, (60_000).to_bytes(4, "big"), chunk_bytes=128))
    reader.take(b"\x04\x00\x00\x00" + size + b"\x09\x01\x00\x00\x00" + bytes(60_000))
    with pytest.raises(RtmpError, match="partial messages"):
        reader.take(b"\x05\x00\x00\x00" + size + b"\x09\x01\x00\x00\x00" + bytes(60_000))


@given(st.binary(max_size=4000))
def test_any_bytes_are_messages_or_an_rtmp_error(data):
    reader = ChunkReader()
    with contextlib.suppress(RtmpError):
        assert sum(len(message.data) for message in reader.take(data)) <= len(data)
