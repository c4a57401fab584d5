import gzip
import struct
import tracemalloc

import numpy as np
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.spz import read_spz, write_spz
from scenes.formats.storage.error import FormatError
from scenes.splats import SplatCloud

# One splat, in the file's axes (x right, y up, z back): position (1, 2, -3), half turn about x.
POSITION = struct.pack("<i", 4096)[:3] + struct.pack("<i", 8192)[:3] + struct.pack("<i", -12288)[:3]
ALPHA, COLOUR, SCALE = b"\xcc", bytes([128, 255, 0]), bytes([160, 144, 128])
THREE = 0 << 30 | 0 << 20 | 0 << 10 | 0
ROTATION = struct.pack("<I", THREE)
SH1 = bytes([136, 128, 120, 144, 128, 112, 152, 128, 104])


def version_3(*, version=3, degree=1, count=1, flags=0, rotation=ROTATION, extra=b"", sh=SH1):
    header = struct.pack("<4sIIBBBB", b"NGSP", version, count, degree, 12, flags, 0)
    payload = POSITION + ALPHA + COLOUR + SCALE + rotation + sh[: 9 if degree else 0] + extra
    return gzip.compress(header + payload, mtime=0)


def version_3_of(n, degree, *, version=3):
    """`n` splats of random bytes."""
    rng = np.random.default_rng(n)
    header = struct.pack("<4sIIBBBB", b"NGSP", version, n, degree, 12, 0, 0)
    rotation = (3, (100, 155)) if version == 2 else (4, (0, 2))
    parts = [(9, (0, 255)), (1, (0, 255)), (3, (0, 255)), (3, (0, 255)), rotation]
    parts.append((3 * (0, 3, 8, 15, 24)[degree], (0, 255)))
    payload = b"".join(
        rng.integers(*limits, n * width, dtype=np.uint8).tobytes() for width, limits in parts
    )
    return gzip.compress(header + payload, mtime=0)


def version_4(
    *,
    version=4,
    degree=1,
    count=1,
    flags=0,
    extensions=b"",
    streams=(POSITION, ALPHA, COLOUR, SCALE, ROTATION, SH1),
    sizes=None,
    announced=True,
):
    packer = zstandard.ZstdCompressor(write_content_size=announced)
    packed = [packer.compress(stream) for stream in streams]
    offset = 32 + len(extensions)
    head = struct.pack(
        "<4sII4BI12x", b"NGSP", version, count, degree, 12, flags, len(packed), offset
    )
    sizes = sizes or [len(s) for s in streams]
    table = b"".join(struct.pack("<QQ", len(p), n) for p, n in zip(packed, sizes, strict=True))
    return head + extensions + table + b"".join(packed)


def check_golden(cloud):
    """y and z change sign on the way to x right, y down, z forward; so do odd harmonics of them."""
    np.testing.assert_array_equal(cloud.means, [[1, -2, 3]])
    np.testing.assert_allclose(cloud.scales, np.exp([[0, -1, -2]]), rtol=1e-6)
    np.testing.assert_allclose(cloud.opacities, [0.8])
    np.testing.assert_array_equal(cloud.rotations, [[0, 1, 0, 0]])
    dc = (np.array([128, 255, 0]) / 255 - 0.5) / 0.15
    np.testing.assert_allclose(cloud.sh[0, 0], dc, rtol=1e-6)
    stored = (np.array([[136, 128, 120], [144, 128, 112], [152, 128, 104]]) - 128) / 128
    np.testing.assert_array_equal(cloud.sh[0, 1:], stored * [[-1], [-1], [1]])


@pytest.mark.parametrize(
    "data",
    [version_3(), version_4(), version_4(announced=False)],
    ids=["v3", "v4", "v4, frames without sizes"],
)
def test_golden_values(tmp_path, data):
    (tmp_path / "a.spz").write_bytes(data)
    check_golden(read_spz(tmp_path / "a.spz"))


def test_version_2_stores_x_y_z_of_the_rotation(tmp_path):
    data = version_3(version=2, degree=0, rotation=bytes([255, 128, 127]))
    (tmp_path / "a.spz").write_bytes(data)
    rotation = read_spz(tmp_path / "a.spz").rotations[0]
    np.testing.assert_allclose(rotation, [0, 1, -0.5 / 127.5, 0.5 / 127.5], atol=1e-4)


@pytest.mark.parametrize("largest", range(4))
def test_the_three_smallest_are_stored_in_order_x_y_z_w(tmp_path, largest):
    # 511 of 511 means 1/√2; the sign is bit 9.
    word = largest << 30 | 511 << 20 | (512 | 100) << 10 | 0
    streams = (POSITION, ALPHA, COLOUR, SCALE, struct.pack("<I", word))
    (tmp_path / "a.spz").write_bytes(version_4(degree=0, streams=streams))
    a, b = 0.5**0.5, -(0.5**0.5) * 100 / 511
    xyzw = [a, b, 0.0]
    xyzw.insert(largest, (1 - a * a - b * b) ** 0.5)
    x, y, z, w = xyzw
    expected = [w, x, -y, -z]
    np.testing.assert_allclose(read_spz(tmp_path / "a.spz").rotations, [expected], atol=1e-6)


def test_golden_bytes_are_written(tmp_path):
    (tmp_path / "a.spz").write_bytes(version_4())
    cloud = read_spz(tmp_path / "a.spz")
    size = write_spz(tmp_path / "b.spz", cloud)
    written = (tmp_path / "b.spz").read_bytes()
    assert size == len(written)
    magic, version, count, *rest = struct.unpack_from("<4sII4BI", written)
    assert (magic, version, count, rest) == (b"NGSP", 4, 1, [1, 12, 0, 6, 32])
    assert written[20:32] == bytes(12)
    table = [struct.unpack_from("<QQ", written, 32 + 16 * i) for i in range(6)]
    at, streams = 32 + 16 * 6, []
    for packed, plain in table:
        streams.append(zstandard.decompress(written[at : at + packed]))
        assert len(streams[-1]) == plain
        at += packed
    assert at == len(written)
    assert streams == [POSITION, ALPHA, COLOUR, SCALE, ROTATION, SH1]


@given(n=st.integers(0, 30), degree=st.integers(0, 3), seed=st.integers(0, 2**32 - 1))
def test_round_trip_within_the_quantisation(tmp_path_factory, random_cloud, n, degree, seed):
    path = tmp_path_factory.mktemp("spz") / "a.spz"
    cloud = random_cloud(n, degree, seed)
    write_spz(path, cloud)
    back = read_spz(path)
    assert back.sh.shape == cloud.sh.shape
    if not n:
        return
    assert np.abs(back.means - cloud.means).max() <= 0.5 / 4096 + 1e-6
    assert np.abs(np.log(back.scales / cloud.scales)).max() <= 0.5 / 16 + 1e-5
    assert np.abs(back.opacities - cloud.opacities).max() <= 0.5 / 255 + 1e-6
    assert np.abs(back.sh[:, 0] - cloud.sh[:, 0]).max() <= 0.5 / 255 / 0.15 + 1e-6
    assert np.abs(back.sh[:, 1:4] - cloud.sh[:, 1:4]).max(initial=0) <= 4.5 / 128 + 1e-6
    assert np.abs(back.sh[:, 4:] - cloud.sh[:, 4:]).max(initial=0) <= 8.5 / 128 + 1e-6
    alignment = np.abs(np.sum(back.rotations * cloud.rotations, axis=1))
    assert alignment.min() > 1 - 1e-5
    write_spz(path, back)
    again = read_spz(path)
    np.testing.assert_array_equal(again.means, back.means)
    np.testing.assert_array_equal(again.opacities, back.opacities)
    np.testing.assert_array_equal(again.sh[:, 0], back.sh[:, 0])


def test_far_positions_cost_resolution_not_correctness(tmp_path, random_cloud):
    near = random_cloud(2)
    means = np.array([[100_000.0, -1.0, 0.25], [0, 0, 0]], np.float32)
    cloud = SplatCloud(means, near.scales, near.rotations, near.opacities, near.sh)
    write_spz(tmp_path / "a.spz", cloud)
    assert np.abs(read_spz(tmp_path / "a.spz").means - means).max() <= 2**-7
    too_far = SplatCloud(means * 100, near.scales, near.rotations, near.opacities, near.sh)
    with pytest.raises(FormatError, match="limits"):
        write_spz(tmp_path / "b.spz", too_far)
    assert not (tmp_path / "b.spz").exists()


def test_the_largest_fixed_point_number_fits(tmp_path, random_cloud):
    near = random_cloud(1)
    means = np.array([[2047.9999, -2048.0, 2048.0]], np.float32)
    cloud = SplatCloud(means, near.scales, near.rotations, near.opacities, near.sh)
    write_spz(tmp_path / "a.spz", cloud)
    assert np.abs(read_spz(tmp_path / "a.spz").means - means).max() <= 2**-11


def test_degree_4_is_read_without_its_last_band(tmp_path):
    streams = (POSITION, ALPHA, COLOUR, SCALE, ROTATION, bytes(range(128, 200)))
    (tmp_path / "a.spz").write_bytes(version_4(degree=4, streams=streams))
    sh = read_spz(tmp_path / "a.spz").sh
    assert sh.shape == (1, 16, 3)
    # The last kept coefficient is even in y and z, so its sign stays.
    np.testing.assert_array_equal(sh[0, 15] * 128, [42, 43, 44])


def test_unknown_extensions_are_skipped_and_other_axes_refused(tmp_path):
    unknown = struct.pack("<II4s", 0x12340001, 4, b"abcd")
    right_up_back = struct.pack("<III", 0xADBE0003, 4, 4)
    data = version_4(flags=3, extensions=unknown + right_up_back)
    (tmp_path / "a.spz").write_bytes(data)
    check_golden(read_spz(tmp_path / "a.spz"))
    left = struct.pack("<III", 0xADBE0003, 4, 7)
    (tmp_path / "a.spz").write_bytes(version_4(flags=2, extensions=unknown + left))
    with pytest.raises(FormatError, match="axes number 7"):
        read_spz(tmp_path / "a.spz")


def test_trailing_bytes_belong_to_announced_extensions_only(tmp_path):
    (tmp_path / "a.spz").write_bytes(version_3(flags=2, extra=b"more"))
    check_golden(read_spz(tmp_path / "a.spz"))
    (tmp_path / "a.spz").write_bytes(version_3(extra=b"more"))
    with pytest.raises(FormatError, match="more bytes than announced"):
        read_spz(tmp_path / "a.spz")


PARTS = (POSITION, ALPHA, COLOUR, SCALE, ROTATION, SH1)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "neither"),
        (b"ply\n", "neither"),
        (version_3(version=1), "version 1"),
        (version_3(version=4), "version 4"),
        (version_4(version=5), "version 5"),
        (version_4(version=3), "version 3"),
        (version_4(degree=5), "degree 5"),
        (version_3(count=2), "truncated"),
        (version_4(count=2), "wanted 18"),
        (version_4(count=2**32 - 1), "4294967295 splats"),
        (version_4(degree=0), "6 streams"),
        (version_4(streams=PARTS[:5]), "5 streams"),
        (version_4(sizes=[9, 1, 3, 3, 4, 10]), "sh"),
        (
            version_4(
                streams=(POSITION + b"x", *PARTS[1:]), sizes=[9, 1, 3, 3, 4, 9], announced=False
            ),
            "more bytes",
        ),
        (
            version_4(
                streams=(POSITION[1:], *PARTS[1:]), sizes=[9, 1, 3, 3, 4, 9], announced=False
            ),
            "8 bytes",
        ),
        (version_4(streams=(POSITION + b"x", *PARTS[1:]), sizes=[9, 1, 3, 3, 4, 9]), "zstd"),
        (version_4(streams=(*PARTS[:4], b"\xff\xff\xff\x3f", SH1)), "number 0 with rotations"),
        (version_3(version=2, degree=0, rotation=b"\xff\xff\xff"), "number 0 with rotations"),
        (version_4().replace(b"\x28\xb5\x2f\xfd", b"\x28\xb5\x2f\xfe"), "zstd"),
        (b"\x1f\x8b" + b"\0" * 40, "gzip"),
    ],
)
def test_damage_is_named_in_one_line(tmp_path, data, said):
    (tmp_path / "a.spz").write_bytes(data)
    with pytest.raises(FormatError, match=said) as caught:
        read_spz(tmp_path / "a.spz")
    assert str(tmp_path / "a.spz") in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "data",
    [
        version_3(count=50_000_000),
        version_4(count=50_000_000, sizes=[n * 50_000_000 for n in (9, 1, 3, 3, 4, 9)]),
        version_4(
            count=50_000_000,
            sizes=[n * 50_000_000 for n in (9, 1, 3, 3, 4, 9)],
            announced=False,
        ),
        version_4(flags=2, extensions=b"\xff" * 2**20),
    ],
    ids=["v3", "v4", "v4, frames without sizes", "extensions"],
)
def test_what_is_only_announced_takes_no_memory(tmp_path, data):
    (tmp_path / "a.spz").write_bytes(data)
    tracemalloc.start()
    with pytest.raises(FormatError):
        read_spz(tmp_path / "a.spz")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2**20


@given(at=st.integers(0, 59), value=st.integers(0, 2**64 - 1))
def test_other_counts_and_sizes_in_the_header_are_refused(tmp_path_factory, at, value):
    good = version_4()
    path = tmp_path_factory.mktemp("spz") / "a.spz"
    path.write_bytes(good[:at] + struct.pack("<Q", value) + good[at + 8 :])
    try:
        cloud = read_spz(path)
    except FormatError:
        return
    assert len(cloud) <= 1


@pytest.mark.parametrize("good", [version_3(), version_3(version=2, rotation=b"abc"), version_4()])
def test_every_truncation_is_refused(tmp_path, good):
    for length in range(len(good)):
        (tmp_path / "a.spz").write_bytes(good[:length])
        with pytest.raises(FormatError):
            read_spz(tmp_path / "a.spz")


@given(version=st.booleans(), at=st.integers(0, 10_000), byte=st.integers(0, 255))
def test_a_changed_byte_never_does_worse_than_an_error(tmp_path_factory, version, at, byte):
    good = version_3() if version else version_4()
    at %= len(good)
    path = tmp_path_factory.mktemp("spz") / "a.spz"
    path.write_bytes(good[:at] + bytes([byte]) + good[at + 1 :])
    try:
        cloud = read_spz(path)
    except FormatError:
        return
    assert np.isfinite(cloud.sh).all()
