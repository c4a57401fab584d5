"""Panoramas: a turn shifts their columns, light does not change them, splats give the same."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.camera.locating.panorama import (
    COLUMNS,
    ROWS,
    STEP_RAD,
    drawn_panorama,
    live_panorama,
    panorama_of,
)


def correlation(a, b):
    weight = a.weight * b.weight
    product = (weight * a.details * b.details).sum()
    power = (weight * a.details**2).sum() * (weight * b.details**2).sum()
    return product / np.sqrt(power)


def test_a_turn_about_the_vertical_shifts_the_columns_round(frame, there):
    turned = Pose.from_yaw(7 * STEP_RAD) @ there
    before, after = live_panorama(frame, there), live_panorama(frame, turned)
    rolled = np.roll(before.details, 7, axis=1)
    assert np.corrcoef(rolled.ravel(), after.details.ravel())[0, 1] > 0.999


def test_half_the_light_changes_little(frame, there):
    dark = replace(frame, images=tuple((0.5 * i).astype(np.uint8) for i in frame.images))
    assert correlation(live_panorama(frame, there), live_panorama(dark, there)) > 0.95


def test_the_drawn_room_is_what_is_seen_there_and_not_elsewhere(frame, there, room_map, table):
    live = live_panorama(frame, there)
    posed, renderer = room_map.posed, table.renderer
    assert correlation(live, drawn_panorama(posed, renderer, there.translation)) > 0.6
    away = there.translation + np.array([-1.2, 0.6, 0.0])
    assert correlation(live, drawn_panorama(posed, renderer, away)) < 0.4


def test_a_lens_that_is_missing_leaves_its_half_without_weight(frame, there):
    rig = replace(frame.rig, lenses=frame.rig.lenses[:1], rig_from_lens=frame.rig.rig_from_lens[:1])
    both = live_panorama(frame, there)
    one = live_panorama(replace(frame, images=frame.images[:1], rig=rig), there)
    assert 0.4 < one.weight.sum() / both.weight.sum() < 0.7


def test_a_blank_picture_has_no_details():
    grey = np.full((ROWS, COLUMNS), 0.5, np.float32)
    panorama = panorama_of(grey, np.ones((ROWS, COLUMNS), np.bool_))
    assert np.abs(panorama.details).max() == pytest.approx(0.0, abs=1e-3)
