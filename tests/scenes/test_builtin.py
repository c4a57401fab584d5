import numpy as np
import pytest

import scenes.builtin
from scenes.builtin import open_builtin
from scenes.mesh import PhysicalRoom
from scenes.opening import open_scene
from scenes.package import load_package
from scenes.pose import Pose


@pytest.fixture
def bakes(monkeypatch, random_cloud):
    """A quick bake that counts its calls."""
    calls = []

    def quick(room, *, rng):
        calls.append(room.name)
        return random_cloud(20, 0, int(rng.integers(2**31))), ()

    monkeypatch.setattr(scenes.builtin, "bake", quick)
    return calls


@pytest.fixture(autouse=True)
def _bare_rooms(monkeypatch):
    """Physical rooms without meshes, since drawing textures takes seconds."""

    def bare(name):
        return PhysicalRoom(name, (), (), (), np.array([0.0, 0.0, 1.0]), Pose.identity())

    monkeypatch.setattr(scenes.builtin, "sample_room", bare)


def test_a_built_in_room_is_baked_once_and_is_the_same_afterwards(bakes, tmp_path):
    first = open_scene("lab", cache_dir=tmp_path)
    second = open_scene("lab", cache_dir=tmp_path)
    assert bakes == ["lab"]
    assert first.physical == "lab"
    assert first.stages[0].name == "bake"
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(first.room, name), getattr(second.room, name))
    assert [p.name.rsplit("-", 1)[0] for p in tmp_path.iterdir()] == ["lab"]


def test_the_seed_is_fixed(bakes, tmp_path):
    one = open_builtin("lab", tmp_path / "one")
    two = open_builtin("lab", tmp_path / "two")
    assert bakes == ["lab", "lab"]
    np.testing.assert_array_equal(one.room.means, two.room.means)


def test_a_damaged_cache_is_made_again(bakes, tmp_path):
    good = open_builtin("lab", tmp_path)
    (folder,) = tmp_path.iterdir()
    (folder / "splats" / "room.ply").write_bytes(b"ply")
    again = open_builtin("lab", tmp_path)
    assert bakes == ["lab", "lab"]
    np.testing.assert_array_equal(again.room.means, good.room.means)


def test_another_process_that_was_faster_is_respected(bakes, tmp_path, monkeypatch, random_cloud):
    def overtaken(room, *, rng):
        monkeypatch.setattr(scenes.builtin, "bake", lambda room, *, rng: (random_cloud(7), ()))
        open_builtin("lab", tmp_path)
        return random_cloud(9), ()

    monkeypatch.setattr(scenes.builtin, "bake", overtaken)
    assert len(open_builtin("lab", tmp_path).room) == 7
    (folder,) = tmp_path.iterdir()
    assert len(load_package(folder).room) == 7
