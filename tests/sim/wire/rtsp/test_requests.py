import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.wire.rtsp.requests import (
    MAX_BODY_BYTES,
    MAX_HEADER_BYTES,
    Interleaved,
    Request,
    RequestReader,
    RtspError,
    interleaved,
    reply,
)

DESCRIBE = b"DESCRIBE rtsp://h/room RTSP/1.0\r\nCSeq: 2\r\nAccept: application/sdp\r\n\r\n"
WANTED = Request("DESCRIBE", "rtsp://h/room", 2, {"cseq": "2", "accept": "application/sdp"})
SET = b"GET_PARAMETER * RTSP/1.0\r\nCSeq: 3\r\nContent-Length: 4\r\n\r\nname"


@given(st.lists(st.integers(1, 40), max_size=20))
def test_in_any_pieces_the_same_comes_out(sizes):
    data = DESCRIBE + interleaved(1, b"report") + b"\r\n" + SET + DESCRIBE
    reader, found = RequestReader(), []
    for size in (*sizes, len(data)):
        found += reader.feed(data[:size])
        data = data[size:]
    assert found[:2] == [WANTED, Interleaved(1, b"report")]
    assert (found[2].cseq, found[2].body, found[3]) == (3, b"name", WANTED)
    assert reader.held_bytes == 0


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", "no request"),
        (b"PLAY * RTSP/1.0\r\n\r\n", "CSeq"),
        (b"PLAY * RTSP/1.0\r\nCSeq: x\r\n\r\n", "CSeq"),
        (b"PLAY * RTSP/1.0\r\nCSeq: 1\r\nno header\r\n\r\n", "no header"),
        (b"PLAY * RTSP/1.0\r\nCSeq: 1\r\nContent-Length: -1\r\n\r\n", "Content-Length"),
        (
            b"PLAY * RTSP/1.0\r\nCSeq: 1\r\nContent-Length: %d\r\n\r\n" % (MAX_BODY_BYTES + 1),
            "at most",
        ),
        (b"PLAY * RTSP/1.0\r\n" + b"A: b\r\n" * 65 + b"\r\n", "65 headers"),
        (b"A" * (MAX_HEADER_BYTES + 5), "no end"),
    ],
)
def test_what_is_no_request_is_refused(data, why):
    with pytest.raises(RtspError, match=why):
        RequestReader().feed(data)


@given(st.lists(st.binary(max_size=300), max_size=40))
def test_whatever_comes_what_is_held_stays_bounded(pieces):
    reader = RequestReader()
    try:
        for piece in pieces:
            reader.feed(piece)
            assert reader.held_bytes <= 4 + 0xFFFF + 300
    except RtspError:
        pass


def test_a_reply_is_what_players_read():
    data = reply(200, 7, {"Session": "1"}, "v=0\r\n")
    assert data == (b"RTSP/1.0 200 OK\r\nCSeq: 7\r\nSession: 1\r\nContent-Length: 5\r\n\r\nv=0\r\n")


def test_a_packet_too_long_for_its_length_is_refused():
    with pytest.raises(ValueError, match="65536"):
        interleaved(0, bytes(0x10000))
