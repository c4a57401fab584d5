import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.insta360.protobuf import (
    BYTES,
    FIXED32,
    FIXED64,
    MAX_FIELDS,
    VARINT,
    ProtobufError,
    bytes_field,
    double,
    double_field,
    inner,
    message,
    raw,
    read_message,
    signed,
    text,
    varint_field,
    whole,
)

fields = st.one_of(
    st.builds(varint_field, st.integers(1, 2000), st.integers(-(1 << 63), (1 << 64) - 1)),
    st.builds(bytes_field, st.integers(1, 2000), st.binary(max_size=300)),
    st.builds(double_field, st.integers(1, 2000), st.floats(allow_nan=False)),
)


@given(st.lists(fields, max_size=12))
def test_what_is_written_is_read(written):
    assert list(read_message(message(*written))) == written


def test_bytes_are_those_of_the_specification():
    """protobuf.dev, "Encoding": 150 in field 1 is 08 96 01, "testing" in field 2 is 12 07 …"""
    assert varint_field(1, 150).encoded == bytes.fromhex("089601")
    assert bytes_field(2, "testing").encoded == b"\x12\x07testing"
    assert varint_field(1, -2).encoded == bytes.fromhex("08feffffffffffffffff01")
    read = read_message(bytes.fromhex("0d01020304 1101020304050607ff 089601"))
    assert [(f.number, f.kind) for f in read] == [(1, FIXED32), (2, FIXED64), (1, VARINT)]
    assert read[0].value == 0x04030201


def test_values_are_found_by_number_and_the_last_one_counts():
    body = message(
        varint_field(1, 5),
        varint_field(1, (1 << 64) - 7),
        bytes_field(2, "grün"),
        bytes_field(3, message(double_field(1, -2.5))),
        bytes_field(4, b"\xff\xfe"),
    )
    read = read_message(body)
    assert whole(read, 1) == (1 << 64) - 7
    assert signed(read, 1) == -7
    assert text(read, 2) == "grün"
    assert double(inner(read, 3) or (), 1) == -2.5
    assert raw(read, 4) == b"\xff\xfe"
    assert text(read, 4) == "\ufffd\ufffd"


def test_another_kind_than_wanted_counts_as_nothing():
    read = read_message(message(varint_field(1, 1), bytes_field(2, b"x"), double_field(3, 1.0)))
    assert (text(read, 1), whole(read, 2), raw(read, 3), double(read, 1)) == (None,) * 4
    assert (whole(read, 9), inner(read, 9), text(read, 9), signed(read, 9)) == (None,) * 4


def test_a_number_that_is_written_longer_than_needed_is_kept_to_the_byte():
    long = bytes.fromhex("08 8100 128000")
    assert message(*read_message(long)) == long


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ("08", "byte 1: a number is cut off"),
        ("08ff", "a number is cut off"),
        ("08" + "ff" * 10, "more than 64 bits"),
        ("08ffffffffffffffffff7f", "more than 64 bits"),
        ("1205ab", "field 2 wants 5 bytes, 1 are left"),
        ("12ffffffffffffffffff01", "wants 18446744073709551615 bytes, 0 are left"),
        ("0901", "field 1 wants 8 bytes, 1 are left"),
        ("0b", "field 1 of wire type 3"),
        ("0000", "field number 0"),
    ],
)
def test_what_is_no_message_says_where(data, says):
    with pytest.raises(ProtobufError, match=says):
        read_message(bytes.fromhex(data))


def test_fields_without_end_are_refused():
    with pytest.raises(ProtobufError, match="more than 16384 fields"):
        read_message(b"\x08\x01" * (MAX_FIELDS + 1))
    assert len(read_message(b"\x08\x01" * MAX_FIELDS)) == MAX_FIELDS


def test_a_number_too_large_to_write_is_refused():
    with pytest.raises(ProtobufError, match="more than 64 bits"):
        varint_field(1, 1 << 64)
    assert bytes_field(1, b"").kind == BYTES
