from __future__ import annotations

import numpy as np
import pytest

from sim.camera.camera360 import default_rig
from sim.camera.sensor import Sensor, SensorOptions

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


def test_bands_and_words_give_what_plain_arithmetic_gives():
    size = 250  # more than two bands, and not a whole number of them
    rng = np.random.default_rng(5)
    picture = rng.integers(0, 256, (size, size, 3), dtype=np.uint8)
    options = SensorOptions(exposure_drift=0.0, colour_drift=0.0, read_noise=3.0, shot_noise=4.0)
    sensor = Sensor(default_rig(size), np.random.default_rng(6), options=options)
    twin = np.random.default_rng(6)
    twin.standard_normal(3)
    table = twin.standard_normal((size + 97, size + 97, 3), dtype=np.float32)
    table = np.clip(np.round(32 * table), -127, 127)
    y, x = np.mgrid[0:size, 0:size] + 0.5
    lens = default_rig(size).lenses[0]
    radius = np.hypot(x - lens.cx, y - lens.cy) / lens.circle_px
    share = 1.0 - options.vignetting * np.clip(radius, 0.0, 1.0) ** 2.5
    share = np.where(radius <= 1.0, share * np.clip((1.0 - radius) * 220.0, 0.0, 1.0), 0.0)
    lit = np.rint(picture * np.round(255 * share)[..., None] / 255).astype(int)
    sigma = np.round(32 * np.sqrt(3.0**2 + 4.0**2 * np.arange(256) / 255))
    sigma[0] = 0
    twin.standard_normal(3)
    for delivered in sensor.expose([picture, picture], 0.1):
        row, column = twin.integers(0, 97, size=2)
        noise = table[row : row + size, column : column + size] * sigma[lit]
        wanted = np.clip(lit + np.rint(noise / 1024), 0, 255)
        assert np.array_equal(delivered, wanted)
