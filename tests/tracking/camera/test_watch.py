"""Pictures of a sphere of noise around the camera: turning it is all that happens."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from scenes.cameras import Fisheye, pixel_centres
from scenes.pose import rotation_from_vector
from tracking.camera.watch import turned_since, watched

LENS = Fisheye.from_fov(960, math.radians(200))
RNG = np.random.default_rng(11)
PANORAMA = cv2.GaussianBlur(RNG.uniform(0, 255, (400, 800, 3)), (0, 0), 3.0)
PANORAMA = ((PANORAMA - PANORAMA.mean()) * 6 + 128).clip(0, 255).astype(np.float32)


def seen(turn, *, gain=1.0, seed=0, hidden=0.0):
    """What the lens shows after a turn (3,), its left part hidden by something plain."""
    x, y, z = (LENS.unproject(pixel_centres(LENS)) @ rotation_from_vector(np.asarray(turn)).T).T
    across = ((np.arctan2(x, z) / (2 * math.pi) + 0.5) * 800).astype(np.float32)
    down = (np.arccos(np.clip(y, -1, 1)) / math.pi * 400).astype(np.float32)
    shape = (LENS.height_px, LENS.width_px)
    drawn = cv2.remap(
        PANORAMA,
        across.reshape(shape),
        down.reshape(shape),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_WRAP,
    )
    noise = np.random.default_rng(seed).normal(0, 3, drawn.shape)
    drawn = drawn * gain + noise
    drawn[:, : int(hidden * LENS.width_px)] = 90
    return drawn.clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("turn_deg", [(0, 0, 0), (0.2, 0, 0), (0, -0.5, 0.3), (1.0, 0.6, -0.8)])
def test_a_turn_is_measured_to_a_fiftieth_of_a_degree(turn_deg):
    turn = np.radians(turn_deg)
    found = turned_since(watched(seen((0, 0, 0)), LENS), seen(turn, seed=1, gain=0.95))
    assert found is not None
    assert np.degrees(np.abs(found - turn).max()) < 0.02


def test_somebody_in_front_of_a_third_of_the_lens_changes_nothing():
    turn = np.radians((0.0, 0.4, 0.0))
    found = turned_since(watched(seen((0, 0, 0)), LENS), seen(turn, seed=1, hidden=0.35))
    assert found is not None
    assert np.degrees(np.abs(found - turn).max()) < 0.03


def test_it_does_not_guess_when_all_is_hidden():
    watch = watched(seen((0, 0, 0)), LENS)
    assert turned_since(watch, seen((0, 0, 0), hidden=1.0)) is None
    other = RNG.integers(0, 255, (960, 960, 3), dtype=np.uint8)
    assert turned_since(watch, cv2.GaussianBlur(other, (0, 0), 8.0)) is None


def test_a_blank_room_cannot_be_watched():
    blank = np.full((960, 960, 3), 120, np.uint8)
    assert turned_since(watched(blank, LENS), blank) is None
