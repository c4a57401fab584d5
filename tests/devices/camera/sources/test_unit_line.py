"""Units on the socket between two processes: what is sent comes back, and nothing else is taken."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera.sources.unit_line import (
    MAX_BYTES,
    UNIT,
    Failed,
    LineError,
    LineReader,
    Opened,
    encode_failed,
    encode_format,
    encode_opened,
    encode_unit,
)
from devices.camera.units import StreamFormat, Unit

words = st.text(st.characters(min_codepoint=0x30, max_codepoint=0x7A), max_size=12)
formats = st.builds(
    StreamFormat,
    codec=words,
    header=st.binary(max_size=200),
    width_px=st.integers(0, 2**32 - 1),
    height_px=st.integers(0, 2**32 - 1),
    pixels=words,
)
units = st.builds(
    Unit,
    format=formats,
    data=st.binary(max_size=400),
    keyframe=st.booleans(),
    pts_ns=st.none() | st.integers(-(2**62), 2**62),
    track=st.integers(0, 255),
)


def fields(unit):
    return unit.format, unit.data, unit.keyframe, unit.pts_ns, unit.track


@given(sent=st.lists(units, max_size=6), cuts=st.lists(st.integers(1, 50), min_size=1))
def test_units_come_back_however_the_bytes_are_cut(sent, cuts):
    wire = encode_opened()
    for unit in sent:
        wire += encode_format(unit.format) + encode_unit(unit)
    wire += encode_failed(Failed("über", is_final=True))
    reader, came, at, turn = LineReader(), [], 0, 0
    while at < len(wire):
        size = cuts[turn % len(cuts)]
        came += reader.take(wire[at : at + size])
        at, turn = at + size, turn + 1
    assert came[0] == Opened()
    assert [fields(unit) for unit in came[1:-1]] == [fields(unit) for unit in sent]
    assert came[-1] == Failed("über", is_final=True)


def test_units_of_one_format_share_it():
    form = StreamFormat("h264", b"header")
    unit = encode_unit(Unit(form, b"picture", True, 5))
    first, second = LineReader().take(encode_format(form) + unit + unit)
    assert first.format is second.format


@given(noise=st.binary(max_size=300))
def test_noise_is_read_or_refused(noise):
    try:
        LineReader().take(noise)
    except LineError:
        return


@pytest.mark.parametrize(
    ("wire", "match"),
    [
        (struct.pack("<BI", UNIT, MAX_BYTES + 1), "at most"),
        (struct.pack("<BI", 77, 0), "not known"),
        (struct.pack("<BI", UNIT, 3) + b"abc", "message 3 of 3 bytes"),
        (encode_unit(Unit(StreamFormat("h264"), b"x", True, None)), "before its format"),
        (struct.pack("<BI", 2, 9) + b"123456789", "without its words"),
    ],
)
def test_what_is_refused_says_why(wire, match):
    with pytest.raises(LineError, match=match):
        LineReader().take(wire)


def test_a_picture_that_is_too_long_is_not_sent():
    with pytest.raises(LineError, match="at most"):
        encode_unit(Unit(StreamFormat("rawvideo"), bytes(MAX_BYTES), True, None))
