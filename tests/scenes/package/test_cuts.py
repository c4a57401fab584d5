"""Cuts in a package: they come back, and damaged ones are refused with the file's name."""

import json

import numpy as np
import pytest

from scenes.cut import divide, restore
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.files import PackageError, fingerprint
from scenes.pose import Pose

FIELDS = ("means", "scales", "rotations", "opacities", "sh")


@pytest.fixture
def saved(random_cloud, tmp_path):
    """The folder of a package with two cuts, and the room before them as its file gives it."""
    empty = ScenePackage(
        "r", random_cloud(50, 1, 4), (), (), Pose.identity(), np.array([[0.0, 0], [1, 1]]), None
    )
    save_package(empty, tmp_path / "s.gnx")
    whole = load_package(tmp_path / "s.gnx").room
    labels, stray = np.arange(50) % 5 == 0, np.arange(50) % 7 == 1
    left, first = divide(whole, labels, object_id="a", floaters=stray & ~labels)
    none = np.zeros(len(left), dtype=bool)
    left, second = divide(
        left, none, object_id="", floaters=np.arange(len(left)) < 3, fill=random_cloud(4, 1, 5)
    )
    package = ScenePackage(
        "r", left, (), (), Pose.identity(), empty.footprint_m, None, cuts=(first, second)
    )
    save_package(package, tmp_path / "s.gnx")
    return tmp_path / "s.gnx", whole


def relist(folder, name):
    """Make the listing agree with a file that was changed on purpose."""
    scene = json.loads((folder / "scene.json").read_text())
    scene["files"][name] = fingerprint(folder / name)
    (folder / "scene.json").write_text(json.dumps(scene))


def test_every_bit_of_the_room_comes_back_through_the_file(saved):
    folder, whole = saved
    package = load_package(folder)
    assert [(cut.object_id, cut.filled) for cut in package.cuts] == [("a", 0), ("", 4)]
    room = package.room
    for cut in reversed(package.cuts):
        room = restore(room, cut)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(room, field), getattr(whole, field))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"splats": "cuts/009.ply"}, "cuts/009.ply is not listed"),
        ({"places": "../scene.json"}, "../scene.json is not listed"),
        ({"places": "cuts/001.places"}, "wanted as many of each"),
        ({"filled": -1}, "filled: -1"),
        ({"filled": True}, "filled True, wanted a whole number"),
        ({"filled": "many"}, "filled 'many', wanted a whole number"),
        ({"object": 7}, "object"),
        ({"splats": None}, "splats"),
    ],
)
def test_records_that_no_cut_can_have(saved, changes, message):
    folder, _ = saved
    path = folder / "cuts.json"
    values = json.loads(path.read_text())
    values["items"][0] |= changes
    path.write_text(json.dumps(values))
    relist(folder, "cuts.json")
    with pytest.raises(PackageError, match=message):
        load_package(folder)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\x01\x00\x00\x00\x02", "whole places of 4"),
        (np.zeros(17, "<u4").tobytes(), "not ascending"),
        (b"", "wanted as many of each"),
    ],
)
def test_damaged_places(saved, content, message):
    folder, _ = saved
    path = folder / "cuts" / "000.places"
    size = path.stat().st_size // 4
    path.write_bytes(content if len(content) != 68 else np.zeros(size, "<u4").tobytes())
    relist(folder, "cuts/000.places")
    with pytest.raises(PackageError, match=message):
        load_package(folder)
