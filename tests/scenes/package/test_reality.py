"""`scenes.package.reality`: a second reconstruction travels with its package, unread."""

import dataclasses
import json

import numpy as np
import pytest

from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.files import PackageError
from scenes.package.reality import REALITY, REALITY_ABOUT, Reality
from scenes.pose import Pose


@pytest.fixture
def package(random_cloud, tmp_path):
    path = tmp_path / "trained.ply"
    write_ply(path, random_cloud(40, 1, 3), comments=[WORLD_COMMENT])
    covariance = np.diag(np.arange(1.0, 8.0)) * 1e-6
    return ScenePackage(
        name="room",
        room=random_cloud(50, 1, 1),
        objects=(),
        codes=(),
        world_from_rig=Pose.identity(),
        footprint_m=np.zeros((2, 2)),
        physical=None,
        reality=Reality(path, "test", 96, 84, covariance),
    )


def test_it_comes_back_and_survives_saving_again(package, tmp_path):
    folder = tmp_path / "room.gnx"
    save_package(package, folder)
    loaded = load_package(folder)
    save_package(dataclasses.replace(loaded, name="renamed"), folder)
    again = load_package(folder).reality
    assert (again.trainer, again.photos, again.shared) == ("test", 96, 84)
    assert np.array_equal(again.covariance, package.reality.covariance)
    assert np.array_equal(again.read().means, package.reality.read().means)


def test_a_compact_package_goes_without(package, tmp_path):
    save_package(package, tmp_path / "small.gnx", compact=True)
    assert not (tmp_path / "small.gnx" / REALITY).exists()
    assert load_package(tmp_path / "small.gnx").reality is None


def test_a_changed_reconstruction_is_noticed(package, tmp_path):
    folder = tmp_path / "room.gnx"
    save_package(package, folder)
    with (folder / REALITY).open("ab") as file:
        file.write(b"x")
    with pytest.raises(PackageError, match=r"room\.ply"):
        load_package(folder)


def test_a_damaged_description_names_the_field(package, tmp_path):
    folder = tmp_path / "room.gnx"
    package_with = dataclasses.replace(package)
    save_package(package_with, folder)
    about = json.loads((folder / REALITY_ABOUT).read_text())
    assert about["photos"] == 96
    with pytest.raises(ValueError, match="7, 7"):
        Reality(folder / REALITY, "test", 1, 1, np.zeros((3, 3)))
