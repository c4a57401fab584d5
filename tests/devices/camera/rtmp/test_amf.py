import contextlib
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera.rtmp.amf import AmfError, decode_amf, encode_amf

leaves = st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=20)
values = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(min_size=1, max_size=5), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.lists(values, max_size=4))
def test_values_come_back(given_values):
    assert decode_amf(encode_amf(*given_values)) == given_values


@given(st.binary(max_size=200))
def test_any_bytes_are_values_or_an_amf_error(data):
    with contextlib.suppress(AmfError):
        assert isinstance(decode_amf(data), list)


def test_bytes_of_another_program_are_read():
    data = b"\x02\x00\x07connect\x00" + struct.pack(">d", 1.0)
    data += b"\x08\x00\x00\x00\x01\x00\x03app\x02\x00\x04live\x00\x00\x09"
    assert decode_amf(data) == ["connect", 1.0, {"app": "live"}]


def test_depth_is_bounded():
    data = b"\x0a\x00\x00\x00\x01" * 1000 + b"\x05"
    with pytest.raises(AmfError, match="levels"):
        decode_amf(data)


def test_a_long_array_is_bounded():
    data = b"\x0a\xff\xff\xff\xff" + b"\x05" * 10_000
    with pytest.raises(AmfError, match="values"):
        decode_amf(data)
