import numpy as np
import pytest

from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.formats.registry import (
    FORMATS,
    is_in_world_frame,
    read_splats,
    write_splats,
)
from scenes.formats.storage.error import FormatError


@pytest.mark.parametrize("suffix", [".ply", ".spz", ".splat", ".glb", ".PLY"])
def test_written_by_name_and_read_back(tmp_path, random_cloud, suffix):
    cloud = random_cloud(20)
    size = write_splats(tmp_path / f"a{suffix}", cloud)
    assert size == (tmp_path / f"a{suffix}").stat().st_size
    np.testing.assert_allclose(read_splats(tmp_path / f"a{suffix}").means, cloud.means, atol=2e-4)


@pytest.mark.parametrize("suffix", [".ply", ".spz", ".glb"])
def test_content_counts_before_the_name(tmp_path, random_cloud, suffix):
    write_splats(tmp_path / f"a{suffix}", random_cloud(20))
    (tmp_path / f"a{suffix}").rename(tmp_path / "wrong.splat")
    assert len(read_splats(tmp_path / "wrong.splat")) == 20


@pytest.mark.parametrize("name", ["a.xyz", "a", "a.compressed.ply", "a.sog", ".splats"])
def test_names_that_cannot_be_written(tmp_path, random_cloud, name):
    with pytest.raises(FormatError, match=r"\.ply, \.spz, \.splat, \.glb, \.usdc"):
        write_splats(tmp_path / name, random_cloud(1))
    assert not list(tmp_path.iterdir())


def test_unknown_things_are_refused_with_what_is_known(tmp_path):
    (tmp_path / "a.txt").write_text("hello")
    with pytest.raises(FormatError, match=r"not a splat file.*\.spz"):
        read_splats(tmp_path / "a.txt")
    with pytest.raises(FormatError, match="No such file"):
        read_splats(tmp_path / "gone.ply")
    with pytest.raises(FormatError, match="folder"):
        read_splats(tmp_path)


def test_every_format_is_found_by_one_of_its_names():
    for entry in FORMATS:
        assert all(suffix == suffix.lower() for suffix in entry.suffixes)
    writable = {entry.name for entry in FORMATS if entry.write}
    assert writable == {"PLY", "SPZ", "splat", "glTF", "USD"}


def test_world_frame_is_told_by_a_ply_comment(tmp_path, random_cloud):
    write_ply(tmp_path / "world.ply", random_cloud(1), comments=[WORLD_COMMENT])
    write_ply(tmp_path / "plain.ply", random_cloud(1))
    write_splats(tmp_path / "a.spz", random_cloud(1))
    assert is_in_world_frame(tmp_path / "world.ply")
    assert not is_in_world_frame(tmp_path / "plain.ply")
    assert not is_in_world_frame(tmp_path / "a.spz")
    assert not is_in_world_frame(tmp_path / "gone.ply")


@pytest.mark.parametrize("start", [b"PXR-USDC", b"#usda 1.0"])
def test_what_is_only_written_is_not_read(tmp_path, start):
    (tmp_path / "a.usd").write_bytes(start)
    with pytest.raises(FormatError, match=r"USD is written only.*\.glb"):
        read_splats(tmp_path / "a.usd")
