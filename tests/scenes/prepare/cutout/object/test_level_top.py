from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.prepare.cutout.object.level_top import level_top, round_top
from scenes.prepare.cutout.votes.seen_from import SeenFrom


def seat(rng, tilt, noise_m, height_m=0.45):
    """A rough seat, tilted about its middle, and four legs."""
    top = rng.uniform((-0.18, -0.18, 0.0), (0.18, 0.18, 0.0), (4000, 3))
    top[:, 2] = height_m + tilt * top[:, 0] + rng.normal(0.0, noise_m, len(top))
    legs = rng.uniform((-0.01, -0.01, 0.0), (0.01, 0.01, height_m - 0.03), (4000, 3))
    legs[:, :2] += rng.choice([-0.12, 0.12], (len(legs), 2))
    return np.concatenate([top, legs])


@settings(max_examples=30, deadline=None)
@given(tilt=st.floats(-0.1, 0.1), noise_m=st.floats(0.0, 0.004))
def test_a_rough_tilted_seat_is_as_high_as_its_middle(tilt, noise_m):
    points = seat(np.random.default_rng(3), tilt, noise_m)
    found = level_top(points, points[:, 2].max())
    assert found is not None
    assert abs(found - 0.45) < 0.006


def test_a_back_is_no_level_top_nor_is_a_wall_or_a_ramp():
    rng = np.random.default_rng(4)
    back = rng.uniform((-0.2, -0.01, 0.5), (0.2, 0.01, 0.9), (4000, 3))
    chair = np.concatenate([seat(rng, 0.0, 0.002), back])
    assert level_top(chair, chair[:, 2].max()) is None
    turn = rng.uniform(0, 2 * np.pi, 4000)
    wall = np.stack([0.04 * np.cos(turn), 0.04 * np.sin(turn), rng.uniform(0, 0.09, 4000)], axis=1)
    assert level_top(wall, wall[:, 2].max()) is None
    ramp = seat(rng, 0.5, 0.0)
    assert level_top(ramp, ramp[:, 2].max()) is None


LEVEL_M = 0.45
FROM = (-0.4, 0.0, 0.4)
MIDDLE = np.array([0.1, -0.2])
COUNT = 20_000


def seen(top, turn, *, side=None, pixel_rad=0.0):
    """A top seen from two metres away, its far side drawn too near, with a leg below it."""
    eye = np.array([0.1 - 2.0 * np.cos(turn), -0.2 + 2.0 * np.sin(turn), 1.4])
    points = np.column_stack([top, np.full(len(top), LEVEL_M)])
    nearer = 1.0 - 0.01 * (points[:, :1] - points[:, 0].min())
    leg = np.zeros((200, 3)) if side is None else side
    return SeenFrom(eye, np.concatenate([eye + (points - eye) * nearer, leg]), pixel_rad)


def disc(rng, radius_m=0.18):
    turn, apart = rng.uniform(0, 2 * np.pi, COUNT), radius_m * np.sqrt(rng.uniform(0, 1, COUNT))
    return MIDDLE + np.column_stack([apart * np.cos(turn), apart * np.sin(turn)])


def test_a_disc_seen_from_one_side_is_found_whole():
    rng = np.random.default_rng(1)
    found = round_top([seen(disc(rng), turn) for turn in FROM], LEVEL_M)
    assert found is not None
    np.testing.assert_allclose(found.middle, MIDDLE, atol=0.004)
    assert abs(found.radius_m - 0.18) < 0.004
    low, high = found.ends(np.array([0.0, 1.0]))
    np.testing.assert_allclose((low, high), (-0.38, -0.02), atol=0.008)


def test_a_rim_lies_half_a_pixel_beyond_the_last_one():
    rng = np.random.default_rng(2)
    pixel_rad = 0.004
    # From about 2.2 m away half a pixel is 4.4 mm across the view.
    views = [seen(disc(rng, 0.18 - 0.0044), turn, pixel_rad=pixel_rad) for turn in FROM]
    found = round_top(views, LEVEL_M)
    assert found is not None
    assert abs(found.radius_m - 0.18) < 0.005


@pytest.mark.parametrize("turned_deg", [0, 20, 45, 70])
@pytest.mark.parametrize("sides_m", [(0.36, 0.36), (0.6, 0.4)])
def test_a_rectangle_is_none(turned_deg, sides_m):
    rng = np.random.default_rng(3)
    c, s = np.cos(np.deg2rad(turned_deg)), np.sin(np.deg2rad(turned_deg))
    flat = rng.uniform(-0.5, 0.5, (COUNT, 2)) * sides_m @ np.array([[c, s], [-s, c]])
    assert round_top([seen(flat + MIDDLE, turn) for turn in FROM], LEVEL_M) is None


def test_too_few_views_or_level_ones_tell_nothing():
    rng = np.random.default_rng(4)
    views = [seen(disc(rng), turn) for turn in FROM]
    assert round_top(views[1:], LEVEL_M) is None
    level_with_it = [SeenFrom(view.eye - (0, 0, 0.8), view.points) for view in views]
    assert round_top(level_with_it, LEVEL_M) is None


def test_most_views_have_to_see_a_circle():
    rng = np.random.default_rng(5)
    square = rng.uniform(-0.18, 0.18, (COUNT, 2)) + MIDDLE
    round_ones = [seen(disc(rng), turn) for turn in FROM]
    assert round_top(round_ones + [seen(square, turn) for turn in FROM], LEVEL_M) is not None
    square_ones = [seen(square, turn) for turn in (*FROM, 0.2)]
    assert round_top(round_ones + square_ones, LEVEL_M) is None
