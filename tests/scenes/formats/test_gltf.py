import json
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.gltf import read_gltf, write_gltf
from scenes.formats.storage.error import FormatError
from scenes.frames import WORLD_FROM_FORWARD_CAMERA, WORLD_FROM_GLTF
from scenes.harmonics import turned
from scenes.pose import Pose
from scenes.splats import SplatCloud

KHR = "KHR_gaussian_splatting"
# One splat of degree 1 in the file's axes (x right, y up, z back): a half turn about x.
VALUES = {
    "POSITION": [1.0, 2.0, -3.0],
    f"{KHR}:ROTATION": [1.0, 0.0, 0.0, 0.0],
    f"{KHR}:SCALE": [0.5, 0.25, 0.125],
    f"{KHR}:OPACITY": [0.75],
    f"{KHR}:SH_DEGREE_0_COEF_0": [0.5, -0.5, 0.25],
    f"{KHR}:SH_DEGREE_1_COEF_0": [1.0, 2.0, 3.0],
    f"{KHR}:SH_DEGREE_1_COEF_1": [4.0, 5.0, 6.0],
    f"{KHR}:SH_DEGREE_1_COEF_2": [7.0, 8.0, 9.0],
}
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


def document_of(values=VALUES, count=1, mesh=0, first=0):
    names = list(values)
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": [KHR],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {
                        "mode": 0,
                        "attributes": {name: i for i, name in enumerate(names)},
                        "extensions": {
                            KHR: {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}
                        },
                    }
                ]
            }
        ],
        "buffers": [{"byteLength": 4 * sum(map(len, values.values()))}],
        "bufferViews": [
            {
                "buffer": 0,
                "byteOffset": 4 * sum(len(values[before]) for before in names[:i]),
                "byteLength": 4 * len(values[name]),
            }
            for i, name in enumerate(names)
        ],
        "accessors": [
            {
                "bufferView": i,
                "componentType": 5126,
                "count": count,
                "type": KINDS[len(values[name]) // count],
            }
            for i, name in enumerate(names)
        ],
    }


def glb(document=None, binary=None, *, text=None):
    text = json.dumps(document or document_of()).encode() if text is None else text
    text += b" " * (-len(text) % 4)
    if binary is None:
        binary = b"".join(struct.pack(f"<{len(v)}f", *v) for v in VALUES.values())
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def changed(*path_and_value):
    """The document with one value changed: changed("nodes", 0, "mesh", 7)."""
    *path, last, value = path_and_value
    document = document_of()
    at = document
    for step in path:
        at = at[step]
    if value is DELETED:
        del at[last]
    else:
        at[last] = value
    return document


DELETED = object()


def deep_nodes(**transform):
    """A mesh in a node in a node, each with this transform."""
    return changed("nodes", [{"children": [1], **transform}, {"mesh": 0, **transform}])


def read(tmp_path, data):
    (tmp_path / "a.glb").write_bytes(data)
    return read_gltf(tmp_path / "a.glb")


def check_golden(cloud):
    """y and z change sign on the way to x right, y down, z forward; so do odd harmonics of them."""
    np.testing.assert_array_equal(cloud.means, [[1, -2, 3]])
    np.testing.assert_array_equal(cloud.scales, [[0.5, 0.25, 0.125]])
    np.testing.assert_array_equal(cloud.rotations, [[0, 1, 0, 0]])
    np.testing.assert_array_equal(cloud.opacities, [0.75])
    first = [[0.5, -0.5, 0.25], [-1, -2, -3], [-4, -5, -6], [7, 8, 9]]
    np.testing.assert_array_equal(cloud.sh, [first])


def test_golden_values(tmp_path):
    check_golden(read(tmp_path, glb()))


def take_apart(data):
    """An independent reading of the container: the document and each attribute's raw bytes."""
    magic, version, total = struct.unpack_from("<4sII", data)
    json_bytes, kind = struct.unpack_from("<I4s", data, 12)
    document = json.loads(data[20 : 20 + json_bytes])
    binary_bytes, binary_kind = struct.unpack_from("<I4s", data, 20 + json_bytes)
    binary = data[28 + json_bytes :]
    assert (magic, version, total) == (b"glTF", 2, len(data))
    assert (kind, binary_kind) == (b"JSON", b"BIN\0")
    assert json_bytes % 4 == 0
    assert binary_bytes % 4 == 0
    assert len(binary) == binary_bytes == document["buffers"][0]["byteLength"]
    return document, binary


def test_golden_bytes_are_written(tmp_path):
    cloud = read(tmp_path, glb())
    size = write_gltf(tmp_path / "b.glb", cloud)
    data = (tmp_path / "b.glb").read_bytes()
    assert size == len(data)
    document, binary = take_apart(data)
    floats = b"".join(struct.pack(f"<{len(v)}f", *v) for v in VALUES.values())
    assert binary[:-4] == floats
    # 0.5 + 0.2821 · sh, from sRGB to linear light, in 255ths.
    assert list(binary[-4:]) == [94, 27, 73, 191]
    (primitive,) = document["meshes"][0]["primitives"]
    assert primitive["mode"] == 0
    assert primitive["extensions"] == {
        KHR: {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}
    }
    assert document["extensionsUsed"] == [KHR]
    assert "extensionsRequired" not in document
    assert list(primitive["attributes"]) == [*VALUES, "COLOR_0"]
    assert document["asset"]["version"] == "2.0"


@given(n=st.integers(1, 30), degree=st.integers(0, 3))
def test_the_structure_is_what_the_specification_asks(tmp_path_factory, random_cloud, n, degree):
    path = tmp_path_factory.mktemp("glb") / "a.glb"
    cloud = random_cloud(n, degree)
    write_gltf(path, cloud)
    document, binary = take_apart(path.read_bytes())
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    harmonics = [name for name in attributes if ":SH_DEGREE_" in name]
    assert harmonics == [
        f"{KHR}:SH_DEGREE_{band}_COEF_{n}"
        for band in range(degree + 1)
        for n in range(2 * band + 1)
    ]
    end = 0
    for name, index in attributes.items():
        entry = document["accessors"][index]
        view = document["bufferViews"][entry["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[entry["type"]]
        size = 1 if name == "COLOR_0" else 4
        assert entry["componentType"] == (5121 if name == "COLOR_0" else 5126)
        assert entry.get("normalized", False) == (name == "COLOR_0")
        assert entry["count"] == n
        assert view["byteOffset"] == end
        assert view["byteOffset"] % 4 == 0
        assert view["byteLength"] == n * width * size
        end += view["byteLength"]
    assert end == len(binary)
    positions = document["accessors"][attributes["POSITION"]]
    stored = np.frombuffer(binary, "<f4", 3 * n).reshape(n, 3)
    assert positions["min"] == stored.min(axis=0).tolist()
    assert positions["max"] == stored.max(axis=0).tolist()


@given(n=st.integers(1, 30), degree=st.integers(0, 3), seed=st.integers(0, 2**32 - 1))
def test_round_trip_is_exact(tmp_path_factory, random_cloud, n, degree, seed):
    path = tmp_path_factory.mktemp("glb") / "a.glb"
    cloud = random_cloud(n, degree, seed)
    write_gltf(path, cloud)
    back = read_gltf(path)
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(back, name), getattr(cloud, name))


def test_world_splats_stand_upright_in_gltf(tmp_path, random_cloud):
    """Turned to the file's axes as `convert` does, world Z becomes glTF Y."""
    in_world = random_cloud(5)
    write_gltf(tmp_path / "a.glb", turned(in_world, WORLD_FROM_FORWARD_CAMERA.inverse()))
    _, binary = take_apart((tmp_path / "a.glb").read_bytes())
    in_gltf = np.frombuffer(binary, "<f4", 15).reshape(5, 3).astype(float)
    np.testing.assert_allclose(WORLD_FROM_GLTF @ in_gltf, in_world.means, atol=1e-6)


def test_normalised_integers_and_strides_are_read(tmp_path):
    row = struct.pack("<3f4b3fBxxx3f", 1, 2, -3, 127, 0, 0, -128, 0.5, 0.25, 0.125, 51, 0, 0, 0)
    names = list(VALUES)[:5]
    formats = [(5126, 0), (5120, 12), (5126, 16), (5121, 28), (5126, 32)]
    document = document_of({name: VALUES[name] for name in names})
    document["bufferViews"] = [{"buffer": 0, "byteLength": 2 * len(row), "byteStride": len(row)}]
    for entry, (component, offset) in zip(document["accessors"], formats, strict=True):
        entry |= {"bufferView": 0, "componentType": component, "byteOffset": offset, "count": 2}
        if component != 5126:
            entry["normalized"] = True
    cloud = read(tmp_path, glb(document, row * 2))
    np.testing.assert_array_equal(cloud.means, [[1, -2, 3]] * 2)
    # -128 counts as -127: w = -1 and x = 1.
    half = 0.5**0.5
    np.testing.assert_allclose(cloud.rotations, [[-half, half, 0, 0]] * 2, atol=1e-6)
    np.testing.assert_allclose(cloud.opacities, [0.2, 0.2], rtol=1e-6)


@pytest.mark.parametrize("as_matrix", [False, True])
def test_nodes_move_turn_and_scale(tmp_path, as_matrix):
    document = document_of()
    # A quarter turn about y, up: x to -z.
    turn = {"rotation": [0, 0.5**0.5, 0, 0.5**0.5], "scale": [2, 2, 2], "translation": [10, 0, 0]}
    if as_matrix:
        turn = {"matrix": [0, 0, -2, 0, 0, 2, 0, 0, 2, 0, 0, 0, 10, 0, 0, 1]}
    document["nodes"] = [{"children": [1], "translation": [0, 5, 0]}, {"mesh": 0, **turn}]
    cloud = read(tmp_path, glb(document))
    # (1, 2, -3) turned is (-3, 2, -1), twice is (-6, 4, -2), moved (4, 9, -2); y, z change sign.
    np.testing.assert_allclose(cloud.means, [[4, -9, 2]], atol=1e-6)
    np.testing.assert_allclose(cloud.scales, [[1, 0.5, 0.25]], rtol=1e-6)
    still = read(tmp_path, glb())
    in_gltf = Pose.from_quaternion([0.5**0.5, 0, 0.5**0.5, 0])
    # The same turn about the flipped axis: y is down in the cloud.
    in_cloud = turned(still, in_gltf.inverse())
    np.testing.assert_allclose(cloud.covariances(), 4 * in_cloud.covariances(), atol=1e-6)
    np.testing.assert_allclose(cloud.sh, in_cloud.sh, atol=1e-5)


def test_meshes_of_other_degrees_are_padded_and_others_left_out(tmp_path):
    document = document_of()
    plain = json.loads(json.dumps(document["meshes"][0]))
    attributes = plain["primitives"][0]["attributes"]
    for name in list(attributes)[5:]:
        del attributes[name]
    triangles = {"primitives": [{"mode": 4, "attributes": {"POSITION": 0}}]}
    document["meshes"] += [plain, triangles]
    document["nodes"] += [{"mesh": 1}, {"mesh": 2}]
    document["scenes"] = [{"nodes": [0, 1, 2]}]
    # Two splats take two positions of the data.
    cloud = read(tmp_path, glb(document))
    assert cloud.sh.shape == (2, 4, 3)
    np.testing.assert_array_equal(cloud.sh[1, 1:], np.zeros((3, 3)))
    np.testing.assert_array_equal(cloud.sh[1, 0], cloud.sh[0, 0])


@pytest.mark.parametrize("without", ["scene", "scenes"])
def test_a_scene_need_not_be_named(tmp_path, without):
    check_golden(read(tmp_path, glb(changed(without, DELETED))))


PRIMITIVE = ("meshes", 0, "primitives", 0)
PROPERTIES = (*PRIMITIVE, "extensions", KHR)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "no GLB header"),
        (b"glTF", "no GLB header"),
        (glb().replace(b"glTF\x02", b"glTF\x01"), "version 1"),
        (glb().replace(b"JSON", b"TEXT"), "TEXT"),
        (glb().replace(b"BIN\0", b"BLOB"), "BLOB"),
        (glb(text=b"[]"), "not an object"),
        (glb(text=b"{nonsense"), "JSONDecodeError"),
        (glb(text=b"[" * 100_000), "RecursionError"),
        (glb(changed("extensionsRequired", ["EXT_meshopt_compression"])), "EXT_meshopt"),
        (glb(changed(*PROPERTIES[:-1], PROPERTIES[-1], {})), "drafts of the extension .* newer"),
        (glb(changed(*PROPERTIES, "kernel", "disc")), "'disc'"),
        (glb(changed(*PROPERTIES, "colorSpace", "lin_rec709_display")), "lin_rec709"),
        (glb(changed(*PRIMITIVE, "mode", 4)), "mode 4"),
        (glb(changed(*PRIMITIVE, "extensions", {})), "0 splats"),
        (glb(changed(*PRIMITIVE, "attributes", "POSITION", DELETED)), "no POSITION"),
        (glb(changed(*PRIMITIVE, "attributes", f"{KHR}:OPACITY", DELETED)), "no .*OPACITY"),
        (glb(changed(*PRIMITIVE, "attributes", f"{KHR}:SH_DEGREE_1_COEF_1", DELETED)), "SH_DEG"),
        (glb(changed(*PRIMITIVE, "attributes", f"{KHR}:SH_DEGREE_1_COEF_2", DELETED)), "SH_DEG"),
        (glb(changed(*PRIMITIVE, "attributes", "POSITION", 99)), "no number 99"),
        (glb(changed(*PRIMITIVE, "attributes", "POSITION", -1)), "no number -1"),
        (glb(changed(*PRIMITIVE, "attributes", "POSITION", "0")), "no number '0'"),
        (glb(changed(*PRIMITIVE, "attributes", "POSITION", 1)), "VEC4.*wanted VEC3"),
        (glb(changed("accessors", 0, "componentType", [])), "components"),
        (glb(changed("accessors", 0, "componentType", 5121)), "normalised"),
        (glb(changed("accessors", 0, "sparse", {})), "not sparse"),
        (glb(changed("accessors", 0, "count", 2)), "POSITION.*2 elements"),
        (glb(changed("accessors", 0, "count", 2**60)), "whole number"),
        (glb(changed("accessors", 0, "count", -1)), "whole number"),
        (glb(changed("accessors", 0, "count", True)), "whole number"),
        (glb(changed("accessors", 0, "count", 0)), r"splats \[0, 1\]|attributes of \[0, 1\]"),
        (glb(changed("accessors", 0, "byteOffset", 1)), "POSITION.*end at byte 13"),
        (glb(changed("accessors", 0, "byteOffset", -4)), "byteOffset.*whole number"),
        (glb(changed("bufferViews", 0, "byteOffset", 2**31)), "at byte 2147483648"),
        (glb(changed("bufferViews", 0, "byteLength", 11)), "view of 11"),
        (glb(changed("bufferViews", 0, "byteStride", 4)), "4 apart"),
        (glb(changed("bufferViews", 0, "byteStride", 2**31)), "2147483648 apart"),
        (glb(changed("bufferViews", 0, "buffer", 1)), "no number 1"),
        (glb(changed("buffers", 0, "uri", "other.bin")), "another file"),
        (glb(changed("nodes", 0, "mesh", 7)), "meshes.*no number 7"),
        (glb(changed("nodes", 0, "children", [0])), "node 0.*more than once"),
        (glb(changed("nodes", 0, "children", [3])), "nodes.*no number 3"),
        (glb(changed("nodes", 0, "children", 3)), "children"),
        (glb(changed("nodes", 0, "scale", [1, 1, 2])), "node 0.*unevenly"),
        (glb(changed("nodes", 0, "scale", [-1, 1, 1])), "node 0.*mirrored"),
        (glb(changed("nodes", 0, "scale", [0, 0, 0])), "node 0.*mirrored"),
        (glb(changed("nodes", 0, "rotation", [0, 0, 0, 0])), "norm 0"),
        (glb(changed("nodes", 0, "rotation", [0, 0, 1])), "not 4 numbers"),
        (glb(changed("nodes", 0, "translation", [0, "x", 0])), "not 3 numbers"),
        (glb(changed("nodes", 0, "translation", [0, float("nan"), 0])), "not 3 numbers"),
        (glb(changed("nodes", 0, "matrix", [0] * 16)), "node 0"),
        (glb(changed("nodes", 0, "translation", [1e12, 0, 0])), "not 3 numbers"),
        (glb(changed("nodes", 0, "matrix", [*np.eye(4).ravel()[:15], 2.0])), "node 0"),
        (glb(deep_nodes(scale=[1e11] * 3)), "node 1.*or more"),
        (glb(deep_nodes(scale=[1e5] * 3), binary=struct.pack("<f", 1e35) + glb()[-88:]), "means"),
        (glb(changed("scenes", 0, "nodes", [])), "0 splats"),
        (glb(binary=struct.pack("<f", np.nan) + glb()[-88:]), "number 0 with means"),
        (glb(binary=glb()[-92:-80] + bytes(16) + glb()[-64:]), "number 0 with quaternion norm 0"),
        (glb(binary=glb()[-92:-64] + struct.pack("<3f", -1, 1, 1) + glb()[-52:]), "scales.*> 0"),
        (glb(binary=glb()[-92:-52] + struct.pack("<f", 1.5) + glb()[-48:]), "opacities"),
    ],
)
def test_damage_is_named_in_one_line(tmp_path, data, said):
    with pytest.raises(FormatError, match=said) as caught:
        read(tmp_path, data)
    assert str(tmp_path / "a.glb") in str(caught.value)
    assert "\n" not in str(caught.value)


def test_one_position_is_not_many_splats(tmp_path):
    """A small file may not become a large cloud by naming the same data again and again."""
    document = document_of()
    document["meshes"] *= 100
    document["nodes"] = [{"mesh": i} for i in range(100)]
    document["scenes"] = [{"nodes": list(range(100))}]
    with pytest.raises(FormatError, match="100 splats in 92 bytes"):
        read(tmp_path, glb(document))


def test_every_truncation_is_refused(tmp_path):
    good = glb()
    for length in range(len(good)):
        with pytest.raises(FormatError):
            read(tmp_path, good[:length])


SIMPLE = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-5, 2**40),
    st.floats(),
    st.text(max_size=3),
    st.lists(st.integers(-2, 9), max_size=5),
    st.dictionaries(st.sampled_from(["a"]), st.none()),
)


def places(value, path=()):
    """The path of every value of a document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    for key, child in inner:
        yield (*path, key)
        if isinstance(child, (dict, list)):
            yield from places(child, (*path, key))


@given(place=st.sampled_from(list(places(document_of()))), value=SIMPLE)
def test_any_other_value_anywhere_never_does_worse_than_an_error(tmp_path_factory, place, value):
    try:
        cloud = read(tmp_path_factory.mktemp("glb"), glb(changed(*place, value)))
    except FormatError:
        return
    assert len(cloud) == 1


@given(at=st.integers(0, len(glb()) - 1), byte=st.integers(0, 255))
def test_a_changed_byte_never_does_worse_than_an_error(tmp_path_factory, at, byte):
    good = glb()
    try:
        cloud = read(tmp_path_factory.mktemp("glb"), good[:at] + bytes([byte]) + good[at + 1 :])
    except FormatError:
        return
    assert np.isfinite(cloud.means).all()


def test_what_a_glb_cannot_hold_is_not_written(tmp_path, random_cloud):
    with pytest.raises(FormatError, match="0 splats"):
        write_gltf(tmp_path / "a.glb", random_cloud(0))
    assert not list(tmp_path.iterdir())


def test_colours_out_of_gamut_are_clipped_in_the_fallback_only(tmp_path):
    one = np.ones((1, 3), np.float32)
    cloud = SplatCloud(one, one, [[1, 0, 0, 0]], [0.0], np.array([[[-9.0, 0.0, 9.0]]]))
    write_gltf(tmp_path / "a.glb", cloud)
    _, binary = take_apart((tmp_path / "a.glb").read_bytes())
    assert list(binary[-4:]) == [0, 55, 255, 0]
    np.testing.assert_array_equal(read_gltf(tmp_path / "a.glb").sh, cloud.sh)
