"""What an object stands on: where the room's splats lie, not where depth and scatter put it."""

import numpy as np
import pytest

from scenes.prepare.cutout.level_planes import support_under

NONE = np.zeros((0, 3))


def points(rng, count, low, high):
    return rng.uniform(low, high, (count, 3))


@pytest.fixture
def seat():
    """A seat's points half a metre above the floor; its legs were not found."""
    return points(np.random.default_rng(1), 2000, (-0.2, -0.2, 0.45), (0.2, 0.2, 0.9))


def floor(rng, *, count=200, at_m=0.0, scatter_m=0.003):
    around = points(rng, count, (-0.35, -0.35, 0.0), (0.35, 0.35, 0.0))
    return around + rng.normal(0.0, (0.0, 0.0, scatter_m), (count, 3)) + (0.0, 0.0, at_m)


def test_splats_that_scatter_about_a_seat_are_no_support(seat):
    rng = np.random.default_rng(0)
    scattered = points(rng, 150, (-0.3, -0.3, 0.2), (0.3, 0.3, 0.7))
    found = support_under(seat, NONE, np.concatenate([floor(rng), scattered]))
    assert abs(found.height_m) < 0.003
    assert found.spread_m < 0.006


def test_a_dark_floor_that_depth_draws_into_the_air_is_where_its_splats_lie(seat):
    rng = np.random.default_rng(0)
    box = seat - (0.0, 0.0, 0.38)
    drawn = floor(rng, count=100, at_m=0.07, scatter_m=0.004)
    haze = points(rng, 100, (-0.3, -0.3, 0.03), (0.3, 0.3, 0.12))
    found = support_under(box, drawn, np.concatenate([floor(rng), haze]))
    assert abs(found.height_m) < 0.003


def test_a_table_top_with_fewer_splats_than_the_floor_stays_the_support(seat):
    rng = np.random.default_rng(0)
    vase = 0.2 * (seat - (0.0, 0.0, 0.45)) + (0.0, 0.0, 0.4)
    top = floor(rng, count=40, at_m=0.4)
    found = support_under(vase, NONE, np.concatenate([floor(rng, count=400), top]))
    assert found.height_m == pytest.approx(0.4, abs=0.003)


def test_a_bottle_stays_on_a_badly_drawn_stool(seat):
    """The floor around the stool has more splats, but none of them is beside the bottle."""
    rng = np.random.default_rng(0)
    bottle = 0.15 * (seat - (0.0, 0.0, 0.45)) + (0.0, 0.0, 0.4)
    top = points(rng, 40, (-0.14, -0.14, 0.388), (0.14, 0.14, 0.412))
    ground = floor(rng, count=900)
    around = ground[np.abs(ground[:, :2]).max(axis=1) > 0.15]
    found = support_under(bottle, NONE, np.concatenate([around, top]))
    assert found.height_m == pytest.approx(0.4, abs=0.005)


def test_with_nothing_below_there_is_none(seat):
    assert support_under(seat, NONE, NONE) is None
    assert support_under(NONE, NONE, floor(np.random.default_rng(0))) is None
