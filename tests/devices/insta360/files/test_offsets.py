from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.wire.fuzz import OFFSET_V1, OFFSET_V2, OFFSET_V3
from devices.insta360.files.offsets import (
    LensV1,
    LensV2,
    LensV3,
    OffsetError,
    OffsetsV1,
    OffsetsV2,
    OffsetsV3,
    read_offsets,
    write_offsets,
)

numbers = st.floats(-1e6, 1e6)
sizes = st.integers(1, 1_000_000)
kinds = st.integers(-(10**6), 10**6)


def lenses(kind, reals, wholes):
    return st.builds(kind, *[numbers] * reals, *([sizes, sizes, kinds] if wholes else []))


def several(lens):
    return st.lists(lens, min_size=1, max_size=4).map(tuple)


any_offsets = st.one_of(
    st.builds(OffsetsV1, several(lenses(LensV1, 6, False)), sizes, sizes, kinds),
    st.builds(OffsetsV2, several(lenses(LensV2, 13, True)), st.one_of(st.none(), kinds)),
    st.builds(OffsetsV3, several(lenses(LensV3, 16, True)), st.one_of(st.none(), kinds)),
)


@pytest.mark.parametrize("text", [OFFSET_V1, OFFSET_V2, OFFSET_V3])
def test_strings_of_a_real_camera_come_back_to_the_character(text):
    assert write_offsets(read_offsets(text)) == text


@given(any_offsets)
def test_whatever_is_written_is_read(offsets):
    assert read_offsets(write_offsets(offsets)) == offsets


def test_numbers_are_where_they_belong():
    v3 = read_offsets(OFFSET_V3)
    assert isinstance(v3, OffsetsV3)
    back = v3.lenses[1]
    assert (back.xi, back.fx_px, back.fy_px, back.cx_px) == (2.0, 4278.09, 4278.39, 8066.33)
    assert (back.yaw_deg, back.pitch_deg, back.roll_deg) == (0.247, -0.221, 89.754)
    assert (back.tx_m, back.ty_m, back.tz_m) == (0.000792, 0.000132, -0.031986)
    assert (back.k1, back.k2, back.k3) == (0.18963484, 2.04539418, -3.23319674)
    assert (back.p1, back.p2) == (0.00101338, 0.00195932)
    assert (back.width_px, back.height_px, back.lens_type, v3.flag) == (10752, 5376, 113, 197632)
    v1 = read_offsets(OFFSET_V1)
    assert isinstance(v1, OffsetsV1)
    assert v1.lenses[0] == LensV1(2657.621, 2684.250, 2687.750, -0.259, -0.011, 89.729)
    assert (v1.width_px, v1.height_px, v1.lens_type) == (10752, 5376, 1137)
    v2 = read_offsets(OFFSET_V2)
    assert isinstance(v2, OffsetsV2)
    assert (v2.lenses[0].radius_px, v2.lenses[0].c2, v2.flag) == (2663.416, -0.18974844, 132096)


def test_one_lens_and_a_string_without_its_flag_are_read():
    one = "1_" + "_".join(OFFSET_V3.split("_")[1:20])
    read = read_offsets(one)
    assert isinstance(read, OffsetsV3)
    assert (len(read.lenses), read.flag) == (1, None)
    assert write_offsets(read) == one


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "number 0 is ''"),
        ("x", "number 0 is 'x'"),
        ("0", "calibration of 0 lenses"),
        ("9", "calibration of 9 lenses, wanted 1 to 8"),
        ("2_1_2_3", r"2 lenses with 3 numbers .* 15 \(version 1\), 33 \(2\) and 39 \(3\)"),
        (OFFSET_V1.replace("2684.250", "nan"), "number 2 is 'nan'"),
        (OFFSET_V1.replace("2684.250", "1e999"), "number 2 is '1e999'"),
        (OFFSET_V1.replace("2684.250", "abc"), "number 2 is 'abc'"),
        (OFFSET_V3.replace("5376", "0"), "size 0 px"),
        (OFFSET_V3.replace("113", "1.5"), "wanted a whole one"),
        (OFFSET_V3.replace("113", "9" * 19), "wanted a whole one"),
        ("1" * 5000, "calibration of 5000 characters, at most 4096"),
    ],
)
def test_what_is_no_calibration_says_why(text, says):
    with pytest.raises(OffsetError, match=says):
        read_offsets(text)


def test_numbers_that_are_none_are_not_written():
    read = read_offsets(OFFSET_V3)
    assert isinstance(read, OffsetsV3)
    with pytest.raises(OffsetError, match="k1 is nan"):
        write_offsets(replace(read, lenses=(replace(read.lenses[0], k1=float("nan")),)))
    with pytest.raises(OffsetError, match="0 lenses"):
        write_offsets(replace(read, lenses=()))
