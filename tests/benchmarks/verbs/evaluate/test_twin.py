"""`nexus evaluate twin`: what it refuses, and the pictures that it rehearses."""

import numpy as np
import pytest

from benchmarks.evaluate.dataset.rehearsed_pictures import RehearsedPictures
from scenes.pose import Pose
from sim.reality.world_error import WorldError
from studio.cli import main


def test_a_folder_that_is_no_dataset_is_named(tmp_path, capsys):
    assert main(["evaluate", "twin", str(tmp_path)]) == 3
    assert "docs/datasets.md" in capsys.readouterr().err


class Pictures(RehearsedPictures):
    """Only where things are drawn, without a room."""

    def __init__(self, error, views):
        self._package_from_true = Pose.from_yaw(0.4, (1.0, 2.0, 0.0))
        self._scan_from_real = error.without_motion(views).inverse()

    def where(self, pose):
        return self._in_scan(pose)


@pytest.fixture
def views():
    return np.random.default_rng(0).uniform(-2, 2, (30, 3))


def test_with_an_exact_scan_things_are_drawn_where_they_are(views):
    exact = Pictures(WorldError(np.eye(3), np.zeros(3)), views)
    pose = Pose.from_yaw(0.2, (0.5, 0.1, 0.0))
    assert np.allclose(exact.where(pose).matrix(), (exact._package_from_true @ pose).matrix())


def test_in_a_scan_that_is_too_small_things_are_nearer_to_each_other(views):
    small = Pictures(WorldError(1.002 * np.eye(3), np.array([0.3, 0.0, 0.0])), views)
    a, b = (small.where(Pose(np.eye(3), np.array([x, 0.0, 0.0]))).translation for x in (0.0, 1.0))
    assert np.linalg.norm(a - b) == pytest.approx(1 / 1.002)
