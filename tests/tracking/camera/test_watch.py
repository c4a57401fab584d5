"""Pictures of a sphere of noise around the camera: turning it is all that happens."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from scenes.cameras import Fisheye, pixel_centres
from scenes.pose import Pose, rotation_from_vector
from tracking.camera.watch import begin_watch, pictured, residual

LENS = Fisheye.from_fov(960, math.radians(200))
RNG = np.random.default_rng(11)
PANORAMA = cv2.GaussianBlur(RNG.uniform(0, 255, (400, 800, 3)), (0, 0), 3.0)
PANORAMA = ((PANORAMA - PANORAMA.mean()) * 6 + 128).clip(0, 255).astype(np.float32)


def seen(turn, *, gain=1.0, seed=0, hidden=0.0):
    """Picture of the lens after a turn (3,), its left part hidden by something plain."""
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


FAR = np.zeros((LENS.height_px, LENS.width_px), np.float32)


@pytest.fixture(scope="module")
def watch():
    return begin_watch(seen((0, 0, 0)), LENS, Pose.identity(), FAR)


@pytest.mark.parametrize("turn_deg", [(0.2, 0, 0), (0, -0.5, 0.3)])
def test_details_follow_a_turn(watch, turn_deg):
    twist = np.array([*np.radians(turn_deg), 0, 0, 0])
    pictures = pictured(seen(twist[:3], seed=1))
    for details, picture in zip(watch.sizes, pictures, strict=True):
        here = np.abs(residual(details, watch.rig_from_lens, twist, picture))
        there = np.abs(residual(details, watch.rig_from_lens, np.zeros(6), picture))
        assert np.median(here) < 0.5 * np.median(there)


def test_derivatives_are_those_of_the_residual(watch):
    details = watch.sizes[-1]
    still = pictured(seen((0, 0, 0)))[-1]
    twist = np.radians((0.03, -0.02, 0.04, 0, 0, 0))
    change = residual(details, watch.rig_from_lens, twist, still)
    expected = details.by_twist @ twist
    assert np.corrcoef(change, expected)[0, 1] > 0.98


def test_other_light_leaves_details_as_they_are(watch):
    darker = pictured(seen((0, 0, 0), gain=0.7, seed=2))[-1]
    left = residual(watch.sizes[-1], watch.rig_from_lens, np.zeros(6), darker)
    assert np.median(np.abs(left)) < 0.2 * np.median(np.abs(watch.sizes[-1].values))


def test_a_shift_moves_what_is_near_and_not_what_is_far():
    near = np.full_like(FAR, 2.0)
    by_shift = begin_watch(seen((0, 0, 0)), LENS, Pose.identity(), near).sizes[-1].flow_by_twist
    sizes = np.linalg.norm(by_shift[:, :, 3:], axis=(1, 2))
    np.testing.assert_allclose(sizes, math.sqrt(2) / 2.0, rtol=0.4)
    far = begin_watch(seen((0, 0, 0)), LENS, Pose.identity(), FAR).sizes[-1].flow_by_twist
    np.testing.assert_allclose(far[:, :, 3:], 0.0, atol=1e-9)


def test_a_blank_room_has_no_details():
    blank = np.full((960, 960, 3), 120, np.uint8)
    assert [len(size.rays) for size in begin_watch(blank, LENS, Pose.identity(), FAR).sizes] == [
        0,
        0,
    ]
