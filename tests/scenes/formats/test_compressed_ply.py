import struct
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.ply import read_ply
from scenes.formats.storage.error import FormatError
from scenes.splats import SH_C0

BOUNDS = [f"{end}_{axis}" for end in ("min", "max") for axis in "xyz"]
SCALES = [f"{end}_scale_{axis}" for end in ("min", "max") for axis in "xyz"]
COLOURS = [f"{end}_{channel}" for end in ("min", "max") for channel in "rgb"]
PACKED = ["packed_position", "packed_rotation", "packed_scale", "packed_color"]
CHUNK = [-1, -2, -3, 1, 2, 3, -6, -6, -6, -2, -2, -2, 0, 0, 0, 1, 1, 1]


def file_bytes(words, *, chunks=(CHUNK,), names=(*BOUNDS, *SCALES, *COLOURS), sh=()):
    head = f"ply\nformat binary_little_endian 1.0\nelement chunk {len(chunks)}\n"
    head += "".join(f"property float {name}\n" for name in names)
    head += f"element vertex {len(words)}\n" + "".join(f"property uint {n}\n" for n in PACKED)
    if sh:
        head += f"element sh {len(sh)}\n"
        head += "".join(f"property uchar f_rest_{i}\n" for i in range(len(sh[0])))
    body = b"".join(struct.pack(f"<{len(names)}f", *chunk) for chunk in chunks)
    body += b"".join(struct.pack("<4I", *word) for word in words)
    body += b"".join(bytes(row) for row in sh)
    return f"{head}end_header\n".encode() + body


# position all low, then all high; rotation: the largest is w, x = y = z = (512/1023 - 0.5)·√2
LOW = (0, 0 << 30 | 512 << 20 | 512 << 10 | 512, 0, 0x00_80_FF_FF)
HIGH = (0xFFFFFFFF, 2 << 30 | 512 << 20 | 512 << 10 | 1023, 0xFFFFFFFF, 0xFF_00_00_00)


def test_golden_values(tmp_path):
    (tmp_path / "a.ply").write_bytes(file_bytes([LOW, HIGH]))
    cloud = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(cloud.means, [[-1, -2, -3], [1, 2, 3]])
    np.testing.assert_allclose(cloud.scales, np.exp([[-6.0] * 3, [-2.0] * 3]), rtol=1e-6)
    np.testing.assert_array_equal(cloud.opacities, [1.0, 0.0])
    np.testing.assert_allclose(cloud.colours(), [[0, 128 / 255, 1], [1, 0, 0]], atol=1e-6)
    tiny, half = (512 / 1023 - 0.5) * 2**0.5, 0.5 * 2**0.5
    first = [(1 - 3 * tiny**2) ** 0.5, tiny, tiny, tiny]
    second = [tiny, tiny, (1 - 2 * tiny**2 - half**2) ** 0.5, half]
    np.testing.assert_allclose(cloud.rotations, [first, second], atol=1e-6)


def test_middle_position_uses_11_10_11_bits(tmp_path):
    word = 1024 << 21 | 512 << 11 | 1023
    (tmp_path / "a.ply").write_bytes(file_bytes([(word, *LOW[1:])]))
    expected = [-1 + 2 * 1024 / 2047, -2 + 4 * 512 / 1023, -3 + 6 * 1023 / 2047]
    np.testing.assert_allclose(read_ply(tmp_path / "a.ply").means, [expected], rtol=1e-6)


def test_without_colour_bounds_colours_are_0_to_1(tmp_path):
    data = file_bytes([LOW], chunks=[CHUNK[:12]], names=(*BOUNDS, *SCALES))
    (tmp_path / "a.ply").write_bytes(data)
    colour = 0.5 + SH_C0 * read_ply(tmp_path / "a.ply").sh[0, 0]
    np.testing.assert_allclose(colour, [0, 128 / 255, 1], atol=1e-6)


def test_each_256_splats_have_their_own_bounds(tmp_path):
    moved = [10, 10, 10, 12, 12, 12, *CHUNK[6:]]
    (tmp_path / "a.ply").write_bytes(file_bytes([LOW] * 257, chunks=[CHUNK, moved]))
    means = read_ply(tmp_path / "a.ply").means
    np.testing.assert_array_equal(means[255], [-1, -2, -3])
    np.testing.assert_array_equal(means[256], [10, 10, 10])


def test_spherical_harmonics_are_channel_major_bytes_over_8(tmp_path):
    row = [0, 255, 127, 128, 1, 2, 3, 4, 5]
    (tmp_path / "a.ply").write_bytes(file_bytes([LOW], sh=[row]))
    sh = read_ply(tmp_path / "a.ply").sh[0, 1:]
    assert sh.shape == (3, 3)
    np.testing.assert_array_equal(sh[:, 0], [-4, 4, 8 * (127.5 / 256 - 0.5)])
    np.testing.assert_allclose(sh[0], [-4, 8 * (128.5 / 256 - 0.5), 8 * (3.5 / 256 - 0.5)])


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (file_bytes([LOW] * 257), "1 chunks for 257 splats, wanted 2"),
        (file_bytes([LOW], chunks=[[np.nan, *CHUNK[1:]]]), "means.*finite"),
        (file_bytes([LOW], chunks=[[*CHUNK[:6], *[200.0] * 6, *CHUNK[12:]]]), "scales"),
        (file_bytes([(0, 0x3FFFFFFF, 0, 0)]), "number 0 with rotations"),
        (file_bytes([LOW, LOW], sh=[[0] * 9]), "1 rows of 9 coefficients for 2"),
        (file_bytes([LOW], sh=[[0] * 12]), "1 rows of 12"),
        (file_bytes([LOW]).replace(b"float min_y", b"float min_q"), "min_y is missing"),
        (file_bytes([LOW]).replace(b"uint packed_scale", b"int packed_scale"), "packed_scale"),
    ],
)
def test_damage_is_named(tmp_path, data, said):
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.raises(FormatError, match=said):
        read_ply(tmp_path / "a.ply")


def test_every_truncation_is_refused(tmp_path):
    good = file_bytes([LOW, HIGH], sh=[[7] * 9] * 2)
    for length in range(len(good)):
        (tmp_path / "a.ply").write_bytes(good[:length])
        with pytest.raises(FormatError):
            read_ply(tmp_path / "a.ply")


FUZZED = file_bytes([LOW, HIGH], sh=[[7] * 9] * 2)


@given(at=st.integers(0, len(FUZZED) - 1), byte=st.integers(0, 255))
def test_a_changed_byte_never_does_worse_than_an_error(tmp_path_factory, at, byte):
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    path.write_bytes(FUZZED[:at] + bytes([byte]) + FUZZED[at + 1 :])
    try:
        cloud = read_ply(path)
    except FormatError:
        return
    assert np.isfinite(cloud.sh).all()


@pytest.mark.parametrize("element", [b"element vertex 2", b"element chunk 1", b"element sh 2"])
def test_hostile_counts_are_refused_before_memory_is_taken(tmp_path, element):
    more = element.rsplit(b" ", 1)[0] + b" 4000000000"
    (tmp_path / "a.ply").write_bytes(FUZZED.replace(element, more))
    tracemalloc.start()
    with pytest.raises(FormatError):
        read_ply(tmp_path / "a.ply")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2**20
