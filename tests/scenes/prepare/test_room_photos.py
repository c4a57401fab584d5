"""The photos of a prepared room: found in its work folder, or a line that says what to do."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.package import ScenePackage, Stage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.pipeline import POINTS_FOLDER
from scenes.prepare.reconstruction import Reconstruction, View, save_reconstruction
from scenes.prepare.room_photos import STRETCHED, photos_of, views_of

CAMERA = Pinhole(64, 48, 50.0, 50.0, 32.0, 24.0)


@pytest.fixture
def package(random_cloud):
    view = ViewPoint("1.jpg", CAMERA, Pose.identity())
    room = random_cloud(10, 1, 1)
    nowhere = np.zeros((2, 2))
    return ScenePackage("attic", room, (), (), Pose.identity(), nowhere, None, views=(view,))


def keep(folder, name):
    (folder / "training").mkdir()
    (folder / "outdoor points").mkdir()
    view = View(name, folder / name, CAMERA, Pose.identity())
    points, errors = np.zeros((1, 3)), np.zeros(1, np.float32)
    kept = Reconstruction((view,), points, np.zeros((1, 3), np.uint8), errors)
    save_reconstruction(kept, folder / "outdoor points" / POINTS_FOLDER)
    return folder


def test_they_are_in_the_work_folder(package, tmp_path):
    found = photos_of(package, keep(tmp_path, "1.jpg"), wanted="look at it")
    assert [view.name for view in found.views] == ["1.jpg"]


def test_without_them_it_says_what_to_do(package, tmp_path):
    wanted = "no finished preparation of 'attic'; to look at it, prepare it again, or name"
    with pytest.raises(ValueError, match=wanted):
        photos_of(package, tmp_path / "gone", wanted="look at it, prepare it again")


def test_photos_of_another_room_are_refused(package, tmp_path):
    with pytest.raises(ValueError, match="other photos than those of 'attic'"):
        photos_of(package, keep(tmp_path, "2.jpg"), wanted="look at it")


def test_a_stretched_room_is_not_that_of_its_photos(package, tmp_path):
    stretched = replace(package, stages=(Stage(STRETCHED),))
    with pytest.raises(ValueError, match=r"stretched per axis.*without --per-axis"):
        photos_of(stretched, keep(tmp_path, "1.jpg"), wanted="prepare it again")


def test_they_stand_where_the_package_has_them(package, tmp_path):
    keep(tmp_path, "1.jpg")
    moved = Pose.from_yaw(0.3, (1.0, 2.0, 3.0))
    view = ViewPoint("1.jpg", CAMERA, moved)
    (found,) = views_of(replace(package, views=(view,)), tmp_path, wanted="look at it")
    np.testing.assert_array_equal(found.world_from_camera.matrix(), moved.matrix())
    assert found.image.name == "1.jpg"
