import gzip

import numpy as np

from scenes.formats.spz import read_spz, write_spz
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.splats import SplatCloud
from studio.web.browser_spz import write_browser_spz


def cloud_with_harmonics(count=500):
    rng = np.random.default_rng(3)
    rotations = rng.normal(size=(count, 4))
    return SplatCloud(
        rng.uniform(-3, 3, (count, 3)).astype(np.float32),
        rng.uniform(0.01, 0.2, (count, 3)).astype(np.float32),
        (rotations / np.linalg.norm(rotations, axis=1, keepdims=True)).astype(np.float32),
        rng.uniform(0.1, 1, count).astype(np.float32),
        rng.normal(0, 0.2, (count, 9, 3)).astype(np.float32),
    )


def test_it_is_version_3_and_holds_what_version_4_holds(tmp_path):
    cloud = cloud_with_harmonics()

    size = write_browser_spz(tmp_path / "a.spz", cloud)
    write_spz(tmp_path / "b.spz", turned(cloud, WORLD_FROM_FORWARD_CAMERA.inverse()))

    start = gzip.decompress((tmp_path / "a.spz").read_bytes())[:8]
    assert start == b"NGSP\x03\x00\x00\x00"
    assert size == (tmp_path / "a.spz").stat().st_size
    ours, theirs = read_spz(tmp_path / "a.spz"), read_spz(tmp_path / "b.spz")
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        assert np.array_equal(getattr(ours, name), getattr(theirs, name)), name
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.spz", "b.spz"]


def test_the_same_splats_are_the_same_bytes(tmp_path):
    for name in ("a.spz", "b.spz"):
        write_browser_spz(tmp_path / name, cloud_with_harmonics())

    assert (tmp_path / "a.spz").read_bytes() == (tmp_path / "b.spz").read_bytes()
