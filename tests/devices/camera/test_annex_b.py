import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera.annex_b import (
    BitstreamError,
    avc_parameter_sets,
    hevc_parameter_sets,
    with_start_codes,
)

SPS, PPS = b"\x67\x42\x00\x1e", b"\x68\xce"
AVCC = b"\x01\x42\x00\x1e\xff\xe1\x00\x04" + SPS + b"\x01\x00\x02" + PPS


def test_parameter_sets_of_h264_are_found():
    sets = avc_parameter_sets(AVCC)
    assert sets.annex_b == b"\x00\x00\x00\x01" + SPS + b"\x00\x00\x00\x01" + PPS
    assert sets.length_bytes == 4


def test_parameter_sets_of_hevc_are_found():
    arrays = b"\x02\xa0\x00\x01\x00\x02AB\xa1\x00\x01\x00\x01C"
    sets = hevc_parameter_sets(b"\x01" + bytes(20) + b"\xff" + arrays)
    assert sets.annex_b == b"\x00\x00\x00\x01AB\x00\x00\x00\x01C"


@pytest.mark.parametrize("cut", range(1, len(AVCC)))
def test_a_record_that_is_cut_short_is_refused(cut):
    with pytest.raises(BitstreamError, match="avcC"):
        avc_parameter_sets(AVCC[:cut])


@given(st.lists(st.binary(max_size=50), max_size=5), st.sampled_from([2, 4]))
def test_lengths_become_start_codes(units, length_bytes):
    data = b"".join(len(unit).to_bytes(length_bytes, "big") + unit for unit in units)
    assert with_start_codes(data, length_bytes) == b"".join(
        b"\x00\x00\x00\x01" + unit for unit in units
    )


@given(st.binary(max_size=100), st.integers(1, 4))
def test_any_bytes_are_units_or_a_bitstream_error(data, length_bytes):
    with contextlib.suppress(BitstreamError):
        converted = with_start_codes(data, length_bytes)
        assert len(converted) <= 5 * len(data)


def test_a_length_beyond_the_end_is_refused():
    with pytest.raises(BitstreamError, match="leads beyond its 5"):
        with_start_codes(b"\x00\x00\x00\x09a", 4)
