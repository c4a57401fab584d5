import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.splat import read_splat, write_splat
from scenes.formats.storage.error import FormatError
from scenes.splats import SH_C0, SplatCloud

ROW = struct.pack("<6f8B", 1, -2, 3, 0.1, 0.2, 0.3, 255, 0, 51, 204, 128, 0, 128, 128)


def test_golden_bytes_of_one_splat(tmp_path):
    cloud = SplatCloud(
        np.array([[1, -2, 3]], np.float32),
        np.array([[0.1, 0.2, 0.3]], np.float32),
        np.array([[0, -1, 0, 0]], np.float32),
        np.array([0.8], np.float32),
        ((np.array([[[1.0, 0.0, 0.2]]]) - 0.5) / SH_C0).astype(np.float32),
    )
    assert write_splat(tmp_path / "a.splat", cloud) == 32
    assert (tmp_path / "a.splat").read_bytes() == ROW
    back = read_splat(tmp_path / "a.splat")
    np.testing.assert_array_equal(back.means, cloud.means)
    np.testing.assert_array_equal(back.scales, cloud.scales)
    np.testing.assert_array_equal(back.rotations, cloud.rotations)
    np.testing.assert_allclose(back.opacities, cloud.opacities)
    np.testing.assert_allclose(back.sh, cloud.sh, atol=1e-6)


@given(n=st.integers(1, 30), degree=st.integers(0, 3), seed=st.integers(0, 2**32 - 1))
def test_round_trip_within_a_byte(tmp_path_factory, random_cloud, n, degree, seed):
    path = tmp_path_factory.mktemp("splat") / "a.splat"
    cloud = random_cloud(n, degree, seed)
    write_splat(path, cloud)
    back = read_splat(path)
    np.testing.assert_array_equal(back.means, cloud.means)
    np.testing.assert_array_equal(back.scales, cloud.scales)
    assert np.abs(back.opacities - cloud.opacities).max() <= 0.5 / 255 + 1e-6
    in_gamut = np.clip(cloud.colours(), 0, 1)
    assert np.abs(back.colours() - in_gamut).max() <= 0.5 / 255 + 1e-6
    alignment = np.abs(np.sum(back.rotations * cloud.rotations, axis=1))
    assert alignment.min() > 1 - 2 * (2 / 128) ** 2


def test_a_cut_inside_a_splat_is_refused(tmp_path):
    data = ROW * 3
    for length in range(len(data)):
        (tmp_path / "a.splat").write_bytes(data[:length])
        if length and length % 32 == 0:
            # The format has no length, so this cannot be told from a whole file.
            assert len(read_splat(tmp_path / "a.splat")) == length // 32
            continue
        with pytest.raises(FormatError, match=f"splat {length // 32}"):
            read_splat(tmp_path / "a.splat")


@pytest.mark.parametrize(
    ("offset", "value", "said"),
    [
        (0, struct.pack("<f", np.nan), "number 1 with means"),
        (8, struct.pack("<f", np.inf), "means"),
        (16, struct.pack("<f", -1.0), "scales.*> 0"),
        (28, bytes([128] * 4), "number 1 with quaternion norm 0"),
    ],
)
def test_bad_values_are_named_with_their_splat(tmp_path, offset, value, said):
    bad = ROW[:offset] + value + ROW[offset + len(value) :]
    (tmp_path / "a.splat").write_bytes(ROW + bad)
    with pytest.raises(FormatError, match=said):
        read_splat(tmp_path / "a.splat")


def test_nothing_cannot_be_written(tmp_path, random_cloud):
    with pytest.raises(FormatError, match="no splats"):
        write_splat(tmp_path / "a.splat", random_cloud(0))
    assert not list(tmp_path.iterdir())
