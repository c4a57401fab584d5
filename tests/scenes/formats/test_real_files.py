"""Real public files, against each other and against Open3D's reader; skipped where absent."""

import numpy as np
import pytest

from scenes.formats.registry import read_splats, write_splats
from scenes.splats import SplatCloud

NAMES = ["biker.compressed.ply", "biker.spz", "guitar.compressed.ply", "playbot_sog"]

# Open3D keeps the axes of the file: SPZ comes out x right, y up, z back.
FLIP = np.array([1, -1, -1], np.float32)
FLIP_SH = np.array([-1, -1, 1, -1, 1, 1, -1, 1])[:, None]


@pytest.mark.parametrize(
    ("name", "count", "degree"),
    list(zip(NAMES, [152_746, 152_746, 90_854, 125_000], [0, 0, 0, 2], strict=True)),
)
def test_counts(real_splats, name, count, degree):
    cloud = read_splats(real_splats / name)
    assert len(cloud) == count
    assert cloud.sh_degree == degree


def test_the_biker_is_the_same_in_spz_and_compressed_ply(real_splats):
    spz = read_splats(real_splats / "biker.spz")
    ply = read_splats(real_splats / "biker.compressed.ply")
    assert np.abs(spz.means - ply.means).max() <= 0.5 / 4096 + 1e-6
    np.testing.assert_allclose(spz.opacities, ply.opacities, atol=1e-6)
    assert np.abs(spz.sh - ply.sh).max() <= 0.5 / 255 / 0.15 + 1e-5
    alignment = np.abs(np.sum(spz.rotations * ply.rotations, axis=1))
    assert alignment.min() > 1 - 1e-5
    # SPZ cannot store scales below e^-10.
    clipped = np.maximum(ply.scales, np.exp(-10))
    assert np.abs(np.log(spz.scales / clipped)).max() <= 0.5 / 16 + 1e-4


@pytest.fixture(scope="module")
def open3d():
    return pytest.importorskip("open3d", reason="Open3D is not installed")


def read_with_open3d(open3d, path) -> SplatCloud:
    points = open3d.t.io.read_point_cloud(str(path)).point
    means, scales, wxyz, logits, dc = (
        points[key].numpy() for key in ("positions", "scale", "rot", "opacity", "f_dc")
    )
    rest = points["f_rest"].numpy() if "f_rest" in points else np.zeros((len(means), 0, 3))
    wxyz = wxyz / np.linalg.norm(wxyz, axis=1, keepdims=True)
    if path.suffix == ".spz":
        means, wxyz = means * FLIP, wxyz * np.concatenate([[1], FLIP])
        rest = rest * FLIP_SH[: rest.shape[1]]
    opacities = 1 / (1 + np.exp(-logits.astype(np.float64).reshape(-1)))
    sh = np.concatenate([dc.reshape(-1, 1, 3), rest], axis=1)
    return SplatCloud(means, scales, wxyz, opacities, sh)


def check_equal(ours: SplatCloud, theirs: SplatCloud):
    np.testing.assert_array_equal(ours.means, theirs.means)
    np.testing.assert_allclose(ours.scales, theirs.scales, rtol=1e-6)
    np.testing.assert_allclose(ours.opacities, theirs.opacities, atol=1e-6)
    np.testing.assert_allclose(ours.rotations, theirs.rotations, atol=1e-6)
    np.testing.assert_allclose(ours.sh, theirs.sh, atol=1e-6)


def test_numbers_equal_open3d_on_the_original_spz(real_splats, open3d):
    path = real_splats / "biker.spz"
    check_equal(read_splats(path), read_with_open3d(open3d, path))


@pytest.mark.parametrize("name", NAMES[2:])
@pytest.mark.parametrize("suffix", [".ply", ".splat", ".spz"])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_numbers_equal_open3d_on_what_we_write(real_splats, open3d, tmp_path, name, suffix):
    path = tmp_path / f"a{suffix}"
    write_splats(path, read_splats(real_splats / name))
    check_equal(read_splats(path), read_with_open3d(open3d, path))
