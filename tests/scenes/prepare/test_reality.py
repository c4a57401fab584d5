"""`scenes.prepare.reality`: which preparations can be rehearsed in, and which cannot."""

import numpy as np
import pytest

from scenes.package import ScenePackage, Stage
from scenes.pose import Pose
from scenes.prepare.pipeline import POINTS_FOLDER
from scenes.prepare.reality import with_reality
from scenes.prepare.reconstruction import Reconstruction, save_reconstruction
from scenes.prepare.room_photos import STRETCHED


def package(random_cloud, **changes):
    values = {
        "name": "attic",
        "room": random_cloud(10, 1, 1),
        "objects": (),
        "codes": (),
        "world_from_rig": Pose.identity(),
        "footprint_m": np.zeros((2, 2)),
        "physical": None,
    }
    return ScenePackage(**{**values, **changes})


def asked(scene, work):
    return with_reality(scene, work, seed=0, seconds=lambda: 0.0, progress=lambda done, note: None)


@pytest.fixture
def work(tmp_path):
    points = np.zeros((1, 3))
    colours, errors = np.zeros((1, 3), np.uint8), np.zeros(1, np.float32)
    for name in ("outdoor points", "training"):
        (tmp_path / name).mkdir()
    empty = Reconstruction((), points, colours, errors)
    save_reconstruction(empty, tmp_path / "outdoor points" / POINTS_FOLDER)
    return tmp_path


def test_without_a_preparation_it_says_what_to_do(random_cloud, tmp_path):
    with pytest.raises(ValueError, match="--rehearsable"):
        asked(package(random_cloud), tmp_path / "nothing")


def test_a_stretched_room_is_refused(random_cloud, work):
    with pytest.raises(ValueError, match="--per-axis"):
        asked(package(random_cloud, stages=(Stage(STRETCHED),)), work)


def test_photos_of_another_room_are_refused(random_cloud, work):
    from scenes.cameras import Pinhole
    from scenes.package.records import ViewPoint

    view = ViewPoint("1.jpg", Pinhole(64, 48, 50.0, 50.0, 32.0, 24.0), Pose.identity())
    with pytest.raises(ValueError, match="other photos"):
        asked(package(random_cloud, views=(view,)), work)
