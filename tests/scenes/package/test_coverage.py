"""Coverage of objects comes back through a package; packages without it still open."""

import json
from dataclasses import replace

import numpy as np
import pytest

from scenes.coverage.record import Coverage
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.coverage import sides_from_json, sides_to_json
from scenes.package.files import PackageError, fingerprint
from scenes.pose import Pose
from scenes.state import ObjectModel

SEEN = "splats/objects/chair-1.seen"


@pytest.fixture
def package(random_cloud):
    rng = np.random.default_rng(3)
    coverage = Coverage(
        rng.integers(0, 2**64, 30, dtype=np.uint64),
        rng.random(30).astype(np.float32) * 1e3,
        rng.integers(0, 2**64, 6, dtype=np.uint64),
    )
    seen, unknown = (
        ObjectModel(
            f"chair-{k}", "Chair", "chair", random_cloud(30, 1, k), (0.4, 0.5, 0.9), 0.0,
            Pose.from_yaw(0.3, (1.0, k, 0.0)), coverage=coverage if k == 1 else None,
        )
        for k in (1, 2)
    )  # fmt: skip
    return ScenePackage(
        "r", random_cloud(50, 1, 4), (seen, unknown), (), Pose.identity(),
        np.array([[-3.0, -3], [3, 3]]), None,
    )  # fmt: skip


def relist(folder, name):
    scene = json.loads((folder / "scene.json").read_text())
    scene["files"][name] = fingerprint(folder / name)
    (folder / "scene.json").write_text(json.dumps(scene))


@pytest.mark.parametrize("compact", [False, True])
def test_every_bit_comes_back(package, tmp_path, compact):
    save_package(package, tmp_path / "r.gnx", compact=compact)
    one, two = load_package(tmp_path / "r.gnx").objects
    assert two.coverage is None
    for name in ("directions", "weights", "sides"):
        kept, wanted = getattr(one.coverage, name), getattr(package.objects[0].coverage, name)
        assert kept.dtype == wanted.dtype
        np.testing.assert_array_equal(kept, wanted)


def test_saving_twice_writes_the_same_bytes(package, tmp_path):
    for name in ("a.gnx", "b.gnx"):
        save_package(package, tmp_path / name)
    for file in (SEEN, "objects.json"):
        assert (tmp_path / "a.gnx" / file).read_bytes() == (tmp_path / "b.gnx" / file).read_bytes()


def test_a_package_of_before_opens_without(package, tmp_path):
    folder = tmp_path / "r.gnx"
    save_package(package, folder)
    (folder / SEEN).unlink()
    scene = json.loads((folder / "scene.json").read_text())
    del scene["files"][SEEN]
    items = json.loads((folder / "objects.json").read_text())
    del items["items"][0]["seen_sides"]
    (folder / "objects.json").write_text(json.dumps(items))
    scene["files"]["objects.json"] = fingerprint(folder / "objects.json")
    (folder / "scene.json").write_text(json.dumps(scene))
    assert [item.coverage for item in load_package(folder).objects] == [None, None]


def test_a_file_of_another_size_is_refused_by_name(package, tmp_path):
    folder = tmp_path / "r.gnx"
    save_package(package, folder)
    (folder / SEEN).write_bytes((folder / SEEN).read_bytes()[:-4])
    with pytest.raises(PackageError, match=r"chair-1\.seen: 356 bytes, .*says"):
        load_package(folder)
    relist(folder, SEEN)
    with pytest.raises(PackageError, match=r"chair-1\.seen: 356 bytes, wanted 360 for 30 splats"):
        load_package(folder)


def test_weights_that_no_photo_gives_are_refused(package, tmp_path):
    folder = tmp_path / "r.gnx"
    save_package(package, folder)
    raw = bytearray((folder / SEEN).read_bytes())
    raw[-4:] = np.float32(np.nan).tobytes()
    (folder / SEEN).write_bytes(raw)
    relist(folder, SEEN)
    with pytest.raises(PackageError, match="negative or not finite"):
        load_package(folder)


@pytest.mark.parametrize(
    "values",
    [None, [], {}, {"+x": "0" * 16}, dict.fromkeys(("+x", "-x", "+y", "-y", "+z", "-z"), "g")],
)
def test_sides_that_are_none_are_refused(values):
    with pytest.raises(ValueError, match="seen_sides"):
        sides_from_json(values)


def test_sides_are_readable_and_come_back(package):
    coverage = package.objects[0].coverage
    written = sides_to_json(replace(coverage))
    assert list(written) == ["+x", "-x", "+y", "-y", "+z", "-z"]
    np.testing.assert_array_equal(sides_from_json(written), coverage.sides)
