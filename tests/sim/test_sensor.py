from __future__ import annotations

import numpy as np
import pytest

from sim.camera360 import default_rig
from sim.sensor import Sensor, SensorOptions

STEADY = SensorOptions(exposure_drift=0.0, colour_drift=0.0)
SIZE = 200


def _grey(level):
    return [np.full((SIZE, SIZE, 3), level, np.uint8)] * 2


def _centre(image):
    return image[80:120, 80:120].astype(float)


@pytest.mark.parametrize("level", [40, 128, 220])
def test_noise_is_centred_and_as_strong_as_read_and_shot_noise_say(level):
    sensor = Sensor(default_rig(SIZE), np.random.default_rng(1), options=STEADY)
    frames = np.array([_centre(sensor.expose(_grey(level), 0.1)[0]) for _ in range(30)])
    wanted = np.hypot(STEADY.read_noise, STEADY.shot_noise * np.sqrt(level / 255))
    assert frames.mean() == pytest.approx(level, abs=1.0)
    assert frames.std(axis=0).mean() == pytest.approx(wanted, rel=0.12)


def test_corners_are_black_and_the_rim_is_darker_than_the_middle():
    sensor = Sensor(default_rig(SIZE), np.random.default_rng(1), options=STEADY)
    image = sensor.expose(_grey(200), 0.1)[0]
    assert image[0, 0].max() == 0
    rim = image[95:105, 4:12].mean()
    assert rim == pytest.approx(200 * (1 - STEADY.vignetting), rel=0.12)


def test_exposure_drifts_slowly_and_stays_small():
    sensor = Sensor(default_rig(SIZE), np.random.default_rng(2))
    means = [_centre(sensor.expose(_grey(128), 0.1)[0]).mean() for _ in range(200)]
    assert np.std(means) > 0.5
    assert np.abs(np.diff(means)).max() < 4.0
    assert np.abs(np.array(means) / 128 - 1).max() < 0.15


def test_the_same_seed_gives_the_same_noise():
    a, b = (Sensor(default_rig(SIZE), np.random.default_rng(3)) for _ in range(2))
    for _ in range(3):
        for x, y in zip(a.expose(_grey(90), 0.1), b.expose(_grey(90), 0.1), strict=True):
            assert np.array_equal(x, y)
