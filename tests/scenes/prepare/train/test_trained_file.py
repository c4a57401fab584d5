import numpy as np
import pytest

from scenes.prepare.train.trained_file import load_training, save_training
from scenes.prepare.train.trainer import Moment, TrainingResult, ViewScore


def test_a_training_comes_back(random_cloud, tmp_path):
    cloud = random_cloud(40, 1, 2)
    result = TrainingResult(
        cloud,
        (ViewScore("a.jpg", 31.5, 0.93), ViewScore("b.jpg", 30.5, 0.91)),
        (Moment(100, 2.5, 30, 0.1, None), Moment(200, 5.0, 40, 0.05, 30.0)),
        "built-in 1",
        0.125,
    )
    save_training(result, tmp_path)
    back = load_training(tmp_path)
    for name in ("held_out", "history", "trainer", "floating"):
        assert getattr(back, name) == getattr(result, name)
    assert back.psnr_db == pytest.approx(31.0)
    np.testing.assert_array_equal(back.cloud.means, cloud.means)
