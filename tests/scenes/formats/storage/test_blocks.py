"""Blocks: a file read in blocks of any size is the file read whole, and written the same bytes."""

import json
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.compressed_ply import CHUNK_SPLATS
from scenes.formats.gltf import read_gltf_blocks, write_gltf_blocks
from scenes.formats.ply import read_ply, read_ply_blocks, write_ply, write_ply_blocks
from scenes.formats.sog import read_sog_blocks
from scenes.formats.splat import read_splat_blocks, write_splat_blocks
from scenes.formats.spz import read_spz_blocks, write_spz_blocks
from scenes.formats.storage.blocks import SplatBlocks, extents, in_blocks, whole
from scenes.formats.storage.error import FormatError
from tests.scenes.formats.test_compressed_ply import CHUNK, HIGH, LOW, file_bytes
from tests.scenes.formats.test_sog import GOOD_QUATS, sog_files, write_folder
from tests.scenes.formats.test_spz import version_3_of

FIELDS = ("means", "scales", "rotations", "opacities", "sh")
PAIRS = [
    (read_ply_blocks, write_ply_blocks),
    (read_splat_blocks, write_splat_blocks),
    (read_spz_blocks, write_spz_blocks),
    (read_gltf_blocks, write_gltf_blocks),
]
pairs = pytest.mark.parametrize(("read", "write"), PAIRS, ids=["ply", "splat", "spz", "glb"])


def check_same(one, other):
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)


def check_any_block_size(read, path, rows):
    at_once = whole(read(path, 10**9))
    splats = read(path, rows)
    blocks = list(splats.blocks)
    assert [len(block) for block in blocks] == [b - a for a, b in extents(splats.count, rows)]
    assert {block.sh_degree for block in blocks} <= {splats.sh_degree}
    check_same(whole(SplatBlocks(splats.count, splats.sh_degree, iter(blocks))), at_once)
    assert len(at_once) == splats.count


@pairs
@given(n=st.integers(1, 60), degree=st.integers(0, 3), rows=st.integers(1, 70))
def test_reading_in_blocks_is_reading_whole(
    tmp_path_factory, random_cloud, read, write, n, degree, rows
):
    path = tmp_path_factory.mktemp("blocks") / "a"
    write(path, in_blocks(random_cloud(n, degree)))
    check_any_block_size(read, path, rows)


@pairs
@given(n=st.integers(1, 60), degree=st.integers(0, 3), rows=st.integers(1, 70))
def test_writing_in_blocks_is_writing_whole(
    tmp_path_factory, random_cloud, read, write, n, degree, rows
):
    folder = tmp_path_factory.mktemp("blocks")
    cloud = random_cloud(n, degree)
    size = write(folder / "blocks", in_blocks(cloud, rows))
    assert size == write(folder / "whole", in_blocks(cloud, n))
    assert (folder / "blocks").read_bytes() == (folder / "whole").read_bytes()
    assert len(list(folder.iterdir())) == 2


@given(rows=st.integers(1, 700))
def test_compressed_ply_in_blocks_across_its_chunks(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp("blocks") / "a.ply"
    moved = [10, 10, 10, 12, 12, 12, *CHUNK[6:]]
    count = 2 * CHUNK_SPLATS + 7
    words = [(LOW if i % 3 else HIGH) for i in range(count)]
    sh = [[i % 256] * 9 for i in range(count)]
    path.write_bytes(file_bytes(words, chunks=[CHUNK, moved, CHUNK], sh=sh))
    check_any_block_size(read_ply_blocks, path, rows)


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("coded", [True, False])
def test_sog_in_blocks(tmp_path, rows, coded):
    bounds = {"mins": [-1] * 3, "maxs": [1] * 3}
    first = (
        {}
        if coded
        else {
            "version": 1,
            "means": {"shape": [2, 3], **bounds, "files": ["means_l.webp", "means_u.webp"]},
            "scales": {**bounds, "files": ["scales.webp"]},
            "sh0": {"mins": [-1] * 4, "maxs": [1] * 4, "files": ["sh0.webp"]},
            "shN": {"mins": -1, "maxs": 1, "files": ["centroids.webp", "labels.webp"]},
        }
    )
    folder = write_folder(tmp_path / "sog", sog_files(quats_webp=GOOD_QUATS, **first))
    assert json.loads((folder / "meta.json").read_bytes())["version"] == (2 if coded else 1)
    check_any_block_size(read_sog_blocks, folder, rows)


@pytest.mark.parametrize("version", [2, 3])
@given(n=st.integers(0, 40), degree=st.integers(0, 4), rows=st.integers(1, 50))
def test_zipped_spz_in_blocks(tmp_path_factory, version, n, degree, rows):
    path = tmp_path_factory.mktemp("blocks") / "a.spz"
    path.write_bytes(version_3_of(n, degree, version=version))
    check_any_block_size(read_spz_blocks, path, rows)


def test_bad_splats_are_numbered_by_the_file_not_by_the_block(tmp_path, random_cloud):
    write_ply(tmp_path / "a.ply", random_cloud(20))
    data = bytearray((tmp_path / "a.ply").read_bytes())
    row = 14 * 4
    data[-3 * row : -3 * row + 4] = np.float32(np.nan).tobytes()
    (tmp_path / "a.ply").write_bytes(data)
    splats = read_ply_blocks(tmp_path / "a.ply", 4)
    assert [len(block) for block in splats.blocks] == [4, 4, 4, 4, 3]
    assert splats.bad.count == 1
    assert splats.bad.first.startswith("number 17 with means")
    with pytest.raises(FormatError, match="number 17 with"):
        read_ply(tmp_path / "a.ply")


@pairs
def test_one_block_is_in_memory_at_a_time(tmp_path, random_cloud, read, write):
    cloud = random_cloud(1000, 3)
    blocks = 200

    def again_and_again():
        splats = SplatBlocks(blocks * len(cloud), 3, iter([cloud] * blocks))
        write(tmp_path / "a", splats)
        for _ in read(tmp_path / "a", len(cloud)).blocks:
            pass

    again_and_again()
    tracemalloc.start()
    again_and_again()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < blocks / 3 * sum(getattr(cloud, name).nbytes for name in FIELDS)


def test_nothing_is_a_cloud_too(random_cloud):
    for degree in range(4):
        empty = whole(SplatBlocks(0, degree, iter(())))
        assert (len(empty), empty.sh_degree) == (0, degree)
    assert list(in_blocks(random_cloud(0)).blocks) == []


def test_changes_come_to_every_block(random_cloud):
    cloud = random_cloud(10)
    splats = in_blocks(cloud, 3).changed(lambda block: block.select(np.arange(len(block))[::-1]))
    assert splats.count == 10
    np.testing.assert_array_equal(next(splats.blocks).means, cloud.means[2::-1])


@pytest.mark.parametrize("room", [0, 1, 7, 20])
def test_room_grows_with_what_arrives(monkeypatch, random_cloud, room):
    monkeypatch.setattr("scenes.formats.storage.blocks.FIRST_ROWS", room)
    cloud = random_cloud(20, 1)
    check_same(whole(in_blocks(cloud, 3)), cloud)
    announced = SplatBlocks(10**12, 1, in_blocks(cloud, 3).blocks)
    check_same(whole(announced), cloud)
