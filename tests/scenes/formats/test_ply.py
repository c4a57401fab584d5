import struct
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.ply import ply_comments, read_ply, write_ply
from scenes.formats.registry import read_splats
from scenes.formats.storage.activation import TINY
from scenes.formats.storage.error import FormatError
from scenes.splats import SplatCloud

BASE = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"]
TAIL = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
VALUES = {
    **dict(zip("xyz", (1.0, -2.0, 3.0), strict=True)),
    "f_dc_0": 0.5,
    "f_dc_1": -0.5,
    "f_dc_2": 0.25,
    "opacity": 0.0,
    "scale_0": -1.0,
    "scale_1": -2.0,
    "scale_2": -3.0,
    "rot_0": 1.0,
    "rot_1": 0.0,
    "rot_2": 0.0,
    "rot_3": 0.0,
}


def ply_bytes(columns, rows, *, kind="float", code="f", order="little", before="", data_before=b""):
    properties = "".join(f"property {kind} {name}\n" for name in columns)
    head = (
        f"ply\nformat binary_{order}_endian 1.0\ncomment made by hand\n{before}"
        f"element vertex {len(rows)}\n{properties}end_header\n"
    )
    sign = "<" if order == "little" else ">"
    body = b"".join(struct.pack(f"{sign}{len(columns)}{code}", *row) for row in rows)
    return head.encode() + data_before + body


def one_row(columns, **changes):
    values = {**VALUES, **changes}
    return [[values.get(name, 0.0) for name in columns]]


def test_golden_bytes_of_one_splat_of_degree_1(tmp_path):
    cloud = SplatCloud(
        np.array([[1, -2, 3]], np.float32),
        np.exp(np.array([[-1, -2, -3]], np.float32)),
        np.array([[0.5, -0.5, 0.5, -0.5]], np.float32),
        np.array([0.5], np.float32),
        np.arange(12, dtype=np.float32).reshape(1, 4, 3),
    )
    size = write_ply(tmp_path / "a.ply", cloud, comments=["hello"])
    names = [*BASE, *(f"f_rest_{i}" for i in range(9)), *TAIL]
    header = "ply\nformat binary_little_endian 1.0\ncomment hello\nelement vertex 1\n"
    header += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    channel_major = [3, 6, 9, 4, 7, 10, 5, 8, 11]
    body = [1, -2, 3, 0, 1, 2, *channel_major, 0, -1, -2, -3, 0.5, -0.5, 0.5, -0.5]
    expected = header.encode() + struct.pack("<23f", *body)
    assert (tmp_path / "a.ply").read_bytes() == expected
    assert size == len(expected)
    assert ply_comments(tmp_path / "a.ply") == ("hello",)
    np.testing.assert_array_equal(read_ply(tmp_path / "a.ply").sh, cloud.sh)


@given(n=st.integers(0, 30), degree=st.integers(0, 3), seed=st.integers(0, 2**32 - 1))
def test_round_trip(tmp_path_factory, random_cloud, n, degree, seed):
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    cloud = random_cloud(n, degree, seed)
    write_ply(path, cloud)
    once = read_ply(path)
    for name in ("means", "rotations", "sh"):
        np.testing.assert_array_equal(getattr(once, name), getattr(cloud, name), err_msg=name)
    np.testing.assert_allclose(once.scales, cloud.scales, rtol=1e-6)
    np.testing.assert_allclose(once.opacities, cloud.opacities, rtol=1e-6, atol=1e-12)
    write_ply(path, once)
    twice = read_ply(path)
    for name in ("means", "rotations", "sh", "scales", "opacities"):
        np.testing.assert_array_equal(getattr(twice, name), getattr(once, name), err_msg=name)


def test_many_rows_cross_a_block(tmp_path, random_cloud):
    cloud = random_cloud(70_000, 1, 3)
    write_ply(tmp_path / "a.ply", cloud)
    back = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(back.means, cloud.means)
    np.testing.assert_array_equal(back.sh, cloud.sh)


def test_fully_opaque_and_invisible_survive(tmp_path, random_cloud):
    cloud = random_cloud(2)
    ends = np.array([0.0, 1.0], np.float32)
    write_ply(
        tmp_path / "a.ply", SplatCloud(cloud.means, cloud.scales, cloud.rotations, ends, cloud.sh)
    )
    np.testing.assert_array_equal(read_ply(tmp_path / "a.ply").opacities, ends)


NORMALS = [*BASE[:3], "nx", "ny", "nz", *BASE[3:], *TAIL]
OTHER = "element camera 2\nproperty uchar a\nproperty short b\n"


@pytest.mark.parametrize(
    ("columns", "layout"),
    [
        (BASE + TAIL, {}),
        (NORMALS, {}),
        ([*reversed(BASE + TAIL)], {}),
        (BASE + TAIL, {"order": "big"}),
        (BASE + TAIL, {"kind": "double", "code": "d"}),
        (BASE + TAIL, {"kind": "float32"}),
        (BASE + TAIL, {"before": OTHER, "data_before": b"\1\2\3" * 2}),
        (BASE + TAIL, {"before": "comment SplatRenderMode: mip\nobj_info x\ncomment\n\n"}),
        ([*BASE, "confidence", *TAIL], {}),
    ],
    ids=["plain", "normals", "reversed", "big", "double", "f32", "element", "comments", "extra"],
)
def test_variants_read_alike(tmp_path, columns, layout):
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns, one_row(columns), **layout))
    cloud = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(cloud.means, [[1, -2, 3]])
    np.testing.assert_array_equal(cloud.sh, [[[0.5, -0.5, 0.25]]])
    np.testing.assert_allclose(cloud.scales, np.exp([[-1, -2, -3]]), rtol=1e-7)
    np.testing.assert_array_equal(cloud.opacities, [0.5])
    np.testing.assert_array_equal(cloud.rotations, [[1, 0, 0, 0]])


def test_windows_line_ends_and_flat_splats(tmp_path):
    columns = [name for name in BASE + TAIL if name != "scale_2"]
    head, _, body = ply_bytes(columns, one_row(columns)).partition(b"end_header\n")
    data = head.replace(b"\n", b"\r\n") + b"end_header\r\n" + body
    (tmp_path / "a.ply").write_bytes(data)
    scales = read_ply(tmp_path / "a.ply").scales[0]
    np.testing.assert_allclose(scales, np.exp([-1, -2, -2]) * [1, 1, 1e-3], rtol=1e-6)


def test_raw_training_quaternions_are_normalised(tmp_path):
    row = one_row(BASE + TAIL, rot_0=3.0, rot_3=-4.0)
    (tmp_path / "a.ply").write_bytes(ply_bytes(BASE + TAIL, row))
    np.testing.assert_allclose(read_ply(tmp_path / "a.ply").rotations, [[0.6, 0, 0, -0.8]])


@pytest.mark.parametrize("name", BASE + TAIL)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_refused_with_their_place(tmp_path, name, value):
    good, bad = one_row(BASE + TAIL)[0], one_row(BASE + TAIL, **{name: value})[0]
    (tmp_path / "a.ply").write_bytes(ply_bytes(BASE + TAIL, [good, good, bad]))
    if name == "opacity" and np.isinf(value):
        # Exporters write infinite logits for opacities of exactly 0 and 1.
        assert read_ply(tmp_path / "a.ply").opacities[2] == (value > 0)
        return
    if name.startswith("scale") and value == -np.inf:
        # And those of flat splats a scale of exactly 0.
        assert read_ply(tmp_path / "a.ply").scales[2].min() == TINY
        return
    with pytest.raises(FormatError, match=r"a\.ply.*2") as caught:
        read_ply(tmp_path / "a.ply")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rot_0": 0.0}, "quaternion norm 0"),
        ({"scale_1": 90.0}, "scales"),
    ],
)
def test_values_no_scan_has_are_refused(tmp_path, changes, said):
    (tmp_path / "a.ply").write_bytes(ply_bytes(BASE + TAIL, one_row(BASE + TAIL, **changes)))
    with pytest.raises(FormatError, match=said):
        read_ply(tmp_path / "a.ply")


@pytest.mark.parametrize(("kind", "largest"), [("uchar", 255), ("float", 1.0), ("ushort", 65535)])
def test_plain_colours_are_read_where_there_are_no_harmonics(tmp_path, kind, largest):
    names = [*BASE[:3], "red", "green", "blue", *TAIL]
    dtype = {"uchar": "u1", "float": "f4", "ushort": "u2"}[kind]
    kinds = [dtype if name in ("red", "green", "blue") else "f4" for name in names]
    row = np.zeros(1, dtype=list(zip(names, ["<" + k for k in kinds], strict=True)))
    row["red"], row["rot_0"] = largest, 1
    lines = ["ply", "format binary_little_endian 1.0", "element vertex 1"]
    lines += [
        f"property {kind if k != 'f4' else 'float'} {n}" for n, k in zip(names, kinds, strict=True)
    ]
    header = "\n".join([*lines, "end_header", ""]).encode()
    (tmp_path / "a.ply").write_bytes(header + row.tobytes())
    np.testing.assert_allclose(read_ply(tmp_path / "a.ply").colours(), [[1, 0, 0]], atol=1e-6)


def test_bad_rows_are_left_out_and_counted(tmp_path):
    good = one_row(BASE + TAIL)[0]
    bad = [one_row(BASE + TAIL, **change)[0] for change in ({"x": np.nan}, {"rot_0": 0.0})]
    path = tmp_path / "a.ply"
    path.write_bytes(ply_bytes(BASE + TAIL, [good, bad[0], good, bad[1]]))
    said = []
    assert len(read_splats(path, on_bad=said.append)) == 2
    assert said[0].startswith("2 of 4 splats are damaged and left out (the first is number 1 with")
    path.write_bytes(ply_bytes(BASE + TAIL, [good, *bad]))
    with pytest.raises(FormatError, match=r"2 of 3 splats are damaged .* at most 50%"):
        read_splats(path)


GOOD = ply_bytes(BASE + TAIL, one_row(BASE + TAIL) * 2)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "not a PLY"),
        (b"solid teapot", "not a PLY"),
        (GOOD.replace(b"binary_little_endian", b"ascii"), "ascii.*binary"),
        (GOOD.replace(b"property float opacity", b"property list uchar int opacity"), "varying"),
        (GOOD.replace(b"property float opacity", b"property float alpha"), "no property opacity"),
        (GOOD.replace(b"property float opacity", b"property text opacity"), "no PLY header line"),
        (GOOD.replace(b"property float opacity", b"property float x"), "twice"),
        (GOOD.replace(b"property float opacity", b"property float f_rest_0"), "f_rest"),
        (GOOD.replace(b"element vertex 2", b"element vertex -2"), "no PLY header line"),
        (GOOD.replace(b"element vertex 2", b"element face 2"), "no element 'vertex'"),
        (GOOD.replace(b"format", b"comment"), "no format"),
        (b"ply\n" + b"comment x\n" * 10_000, "header does not end"),
    ],
)
def test_foreign_files_are_refused_in_one_line(tmp_path, data, said):
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.raises(FormatError, match=said) as caught:
        read_ply(tmp_path / "a.ply")
    assert str(tmp_path / "a.ply") in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_truncation_is_refused(tmp_path):
    path = tmp_path / "a.ply"
    for length in range(len(GOOD)):
        path.write_bytes(GOOD[:length])
        with pytest.raises(FormatError):
            read_ply(path)


def test_a_hostile_count_is_refused_before_memory_is_taken(tmp_path):
    (tmp_path / "a.ply").write_bytes(GOOD.replace(b"vertex 2", b"vertex 4000000000"))
    tracemalloc.start()
    with pytest.raises(FormatError, match="ends there"):
        read_ply(tmp_path / "a.ply")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2**20


@given(at=st.integers(0, len(GOOD) - 1), byte=st.integers(0, 255))
def test_a_changed_byte_never_does_worse_than_an_error(tmp_path_factory, at, byte):
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    path.write_bytes(GOOD[:at] + bytes([byte]) + GOOD[at + 1 :])
    try:
        cloud = read_ply(path)
    except FormatError:
        return
    assert np.isfinite(cloud.means).all()
