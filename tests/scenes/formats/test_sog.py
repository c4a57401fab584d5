import io
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from scenes.formats.sog import is_sog_folder, read_sog
from scenes.formats.storage.error import FormatError

CODEBOOK = [i / 32 - 4 for i in range(256)]
MEANS = {"mins": [-1, -1, -1], "maxs": [1, 1, 1], "files": ["means_l.webp", "means_u.webp"]}


def webp(rows):
    buffer = io.BytesIO()
    pixels = np.array(rows, dtype=np.uint8)
    Image.fromarray(pixels).save(buffer, "WEBP", lossless=True, exact=True)
    return buffer.getvalue()


def sog_files(**changes):
    """Two splats in a 2×1 texture, palette of 64 entries of degree 1."""
    palette = np.zeros((1, 64 * 3, 3), dtype=np.uint8)
    palette[0, 3:6] = [[0, 32, 64], [96, 128, 160], [192, 224, 255]]
    meta = {
        "version": 2,
        "count": 2,
        "means": MEANS,
        "scales": {"codebook": CODEBOOK, "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"codebook": CODEBOOK, "files": ["sh0.webp"]},
        "shN": {
            "count": 64,
            "bands": 1,
            "codebook": CODEBOOK,
            "files": ["centroids.webp", "labels.webp"],
        },
    }
    files = {
        "means_l.webp": webp([[[0, 255, 0], [255, 0, 0]]]),
        "means_u.webp": webp([[[0, 255, 128], [255, 0, 128]]]),
        "scales.webp": webp([[[0, 32, 64], [255, 128, 64]]]),
        "quats.webp": webp([[[255, 127, 0, 252], [128, 128, 128, 255]]]),
        "sh0.webp": webp([[[0, 128, 255, 0], [1, 2, 3, 255]]]),
        "centroids.webp": webp(palette),
        "labels.webp": webp([[[1, 0, 0], [0, 0, 0]]]),
    }
    meta.update({k: v for k, v in changes.items() if not k.endswith("_webp")})
    files.update({f"{k[:-5]}.webp": v for k, v in changes.items() if k.endswith("_webp")})
    return {"meta.json": json.dumps(meta).encode(), **files}


def write_folder(folder, files):
    folder.mkdir(exist_ok=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return folder


def write_zip(path, files):
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def test_golden_values_of_version_2(tmp_path):
    files = sog_files(quats_webp=webp([[[255, 127, 1, 252], [128, 128, 128, 255]]]))
    cloud = read_sog(write_folder(tmp_path / "room", files))
    book = np.array(CODEBOOK)
    np.testing.assert_allclose(cloud.sh[0, 1:, 0], book[[0, 96, 192]])
    np.testing.assert_allclose(cloud.sh[0, 1, :], book[[0, 32, 64]])
    np.testing.assert_array_equal(cloud.sh[1, 1:], CODEBOOK[0])
    edge, middle = np.e - 1, np.expm1(-1 + 2 * 128 * 256 / 65535)
    expected = [[-edge, edge, middle], [edge, -edge, middle]]
    np.testing.assert_allclose(cloud.means, expected, rtol=1e-6)
    np.testing.assert_allclose(cloud.scales, np.exp(book[[[0, 32, 64], [255, 128, 64]]]), rtol=1e-6)
    np.testing.assert_allclose(cloud.sh[:, 0], book[[[0, 128, 255], [1, 2, 3]]])
    np.testing.assert_array_equal(cloud.opacities, [0.0, 1.0])
    x, y, z = 0.5**0.5, -(0.5**0.5) / 255, -(0.5**0.5) * 253 / 255
    w = (1 - x * x - y * y - z * z) ** 0.5
    np.testing.assert_allclose(cloud.rotations[0], [w, x, y, z], atol=1e-6)
    s = 0.5**0.5 / 255
    np.testing.assert_allclose(cloud.rotations[1], [s, s, s, (1 - 3 * s * s) ** 0.5], atol=1e-6)


GOOD_QUATS = webp([[[200, 127, 50, 252], [128, 128, 128, 255]]])


def test_version_1_lies_between_bounds(tmp_path):
    files = sog_files(quats_webp=GOOD_QUATS)
    meta = {
        "means": {**MEANS, "shape": [2, 3]},
        "scales": {"mins": [-8, -8, -8], "maxs": [0, 0, 0], "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"mins": [-1, -1, -1, -4], "maxs": [1, 1, 1, 4], "files": ["sh0.webp"]},
        "shN": {"mins": -2, "maxs": 2, "files": ["centroids.webp", "labels.webp"]},
    }
    files["meta.json"] = json.dumps(meta).encode()
    cloud = read_sog(write_folder(tmp_path / "room", files))
    stored = np.array([[0, 32, 64], [255, 128, 64]])
    np.testing.assert_allclose(cloud.scales, np.exp(-8 + 8 * stored / 255), rtol=1e-6)
    np.testing.assert_allclose(cloud.opacities, 1 / (1 + np.exp([4, -4])), rtol=1e-6)
    np.testing.assert_allclose(cloud.sh[0, 0], [-1, -1 + 2 * 128 / 255, 1], atol=1e-6)
    np.testing.assert_allclose(cloud.sh[0, 1], -2 + 4 * np.array([0, 32, 64]) / 255, atol=1e-6)


def test_folder_meta_file_and_zip_are_the_same(tmp_path):
    files = sog_files(quats_webp=GOOD_QUATS)
    folder = write_folder(tmp_path / "room", files)
    assert is_sog_folder(folder)
    assert not is_sog_folder(tmp_path)
    clouds = [
        read_sog(folder),
        read_sog(folder / "meta.json"),
        read_sog(write_zip(tmp_path / "room.sog", files)),
    ]
    for cloud in clouds[1:]:
        np.testing.assert_array_equal(cloud.means, clouds[0].means)
        np.testing.assert_array_equal(cloud.sh, clouds[0].sh)


def test_without_higher_harmonics(tmp_path):
    files = sog_files(quats_webp=GOOD_QUATS, shN=None)
    assert read_sog(write_folder(tmp_path / "room", files)).sh.shape == (2, 1, 3)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"version": 3}, "version 3"),
        ({"count": 3}, "2 pixels for 3 splats"),
        ({"count": -1}, "-1 splats"),
        ({"count": 10**12}, "1000000000000 splats"),
        ({"means": {**MEANS, "mins": [0, 0]}}, "bounds of shapes"),
        ({"means": {**MEANS, "maxs": [float("nan")] * 3}}, "means"),
        ({"means": {**MEANS, "files": ["../a.webp", "b.webp"]}}, "file name"),
        ({"means": {**MEANS, "files": ["/etc/passwd", "b.webp"]}}, "file name"),
        ({"means": {**MEANS, "files": ["gone.webp", "b.webp"]}}, "gone.webp.*missing"),
        ({"quats": {}}, "KeyError: 'files'"),
        ({"scales": {"codebook": [None] * 256, "files": ["scales.webp"]}}, "scales"),
        ({"scales": {"codebook": [1.0], "files": ["scales.webp"]}}, "codebook"),
        ({"quats_webp": webp([[[0, 0, 0, 251], [0, 0, 0, 255]]])}, "splat 0.*rotation tag 251"),
        ({"quats_webp": webp([[[0, 0, 0, 252], [0, 0, 0, 255]]])}, "number 0 with rotations"),
        ({"labels_webp": webp([[[0, 0, 0], [64, 0, 0]]])}, "splat 1.*palette entry 64"),
        ({"centroids_webp": webp([[[0, 0, 0]] * 100])}, "100 pixels wide"),
        ({"sh0_webp": b"RIFF"}, "sh0.webp"),
    ],
)
def test_damage_is_named_in_one_line(tmp_path, changes, said):
    files = sog_files(**{"quats_webp": GOOD_QUATS, **changes})
    with pytest.raises(FormatError, match=said) as caught:
        read_sog(write_folder(tmp_path / "room", files))
    assert "\n" not in str(caught.value)


def test_a_meta_file_that_is_not_json(tmp_path):
    files = {**sog_files(), "meta.json": b"{"}
    with pytest.raises(FormatError, match=r"meta\.json"):
        read_sog(write_folder(tmp_path / "room", files))


def test_every_truncation_of_the_zip_is_refused(tmp_path):
    path = write_zip(tmp_path / "a.sog", sog_files(quats_webp=GOOD_QUATS, shN=None))
    good = path.read_bytes()
    for length in range(0, len(good), 7):
        path.write_bytes(good[:length])
        with pytest.raises(FormatError):
            read_sog(path)


META_PLACES = [
    (),
    *[(name,) for name in ("version", "count", "means", "scales", "quats", "sh0", "shN")],
    *[("means", name) for name in ("mins", "maxs", "files")],
    *[("means", "files", 0), ("means", "mins", 0), ("scales", "codebook", 0)],
    *[("shN", name) for name in ("codebook", "files")],
]
ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-5, 2**70),
    st.floats(),
    st.text(max_size=3),
    st.lists(st.integers(-2, 9), max_size=5),
    st.dictionaries(st.sampled_from(["files", "mins"]), st.none()),
)


@given(place=st.sampled_from(META_PLACES), value=ANYTHING)
def test_any_other_value_anywhere_never_does_worse_than_an_error(tmp_path_factory, place, value):
    files = sog_files(quats_webp=GOOD_QUATS)
    meta = {"": json.loads(files["meta.json"])}
    *path, last = ("", *place)
    at = meta
    for step in path:
        at = at[step]
    at[last] = value
    files["meta.json"] = json.dumps(meta[""]).encode()
    try:
        cloud = read_sog(write_folder(tmp_path_factory.mktemp("sog"), files))
    except FormatError:
        return
    assert np.isfinite(cloud.means).all()


METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA)


@given(method=st.sampled_from(METHODS), at=st.integers(0, 10_000), byte=st.integers(0, 255))
def test_a_changed_byte_never_does_worse_than_an_error(tmp_path_factory, method, at, byte):
    path = tmp_path_factory.mktemp("sog") / "a.sog"
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, data in sog_files(quats_webp=GOOD_QUATS).items():
            archive.writestr(name, data)
    good = path.read_bytes()
    at %= len(good)
    path.write_bytes(good[:at] + bytes([byte]) + good[at + 1 :])
    try:
        cloud = read_sog(path)
    except FormatError:
        return
    assert np.isfinite(cloud.means).all()


def test_a_meta_file_nested_without_end(tmp_path):
    files = {**sog_files(), "meta.json": b"[" * 100_000}
    with pytest.raises(FormatError, match=r"meta\.json"):
        read_sog(write_folder(tmp_path / "room", files))
    assert not is_sog_folder(tmp_path / "room")
