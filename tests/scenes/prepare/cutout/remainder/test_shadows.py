"""The shadow of a thing on its support goes with the thing."""

import numpy as np
import pytest

from scenes.prepare.cutout.remainder.shadows import without_shadow
from scenes.splats import SH_C0, SplatCloud

WOOD, LINE = np.array([0.7, 0.5, 0.3]), np.array([0.3, 0.35, 0.5])


def flat(places, colours, height_m=0.0):
    n = len(places)
    return SplatCloud(
        np.column_stack([places, np.full(n, height_m)]).astype(np.float32),
        np.tile(np.array([0.02, 0.02, 0.001], np.float32), (n, 1)),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, 0.9, np.float32),
        ((colours - 0.5) / SH_C0).astype(np.float32)[:, None, :],
    )


@pytest.fixture
def floor():
    """Places every 2 cm, their colours in the light, and how dark a shadow about the middle is."""
    steps = np.arange(-1.2, 1.2, 0.02)
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    colours = np.where((np.round(places[:, :1] / 0.02) % 8 == 0), LINE, WOOD)
    away = np.hypot(*places.T)
    shade = 1.0 - 0.5 * np.exp(-0.5 * (away / 0.15) ** 2)
    return places, colours, shade


FOOTPRINT = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 0.4)])


def test_a_shadow_is_lifted_and_the_pattern_stays(floor):
    places, colours, shade = floor
    room = flat(places, colours * shade[:, None])
    shaded, lit = without_shadow(room, FOOTPRINT, 0.0)
    dark = shade < 0.8
    assert shaded[dark].mean() > 0.95
    assert not shaded[np.hypot(*places.T) > 0.7].any()
    np.testing.assert_array_equal(lit.means, room.means[shaded])
    before = np.abs(room.colours()[dark] - colours[dark]).mean()
    now = room.colours().copy()
    now[shaded] = lit.colours()
    assert np.abs(now[dark] - colours[dark]).mean() < 0.3 * before
    line = (colours == LINE).all(axis=1)
    assert now[dark & line].mean() < 0.8 * now[dark & ~line].mean()


def test_a_support_in_even_light_stays_as_it_is(floor):
    places, colours, _ = floor
    shaded, lit = without_shadow(flat(places, colours), FOOTPRINT, 0.0)
    assert not shaded.any()
    assert len(lit) == 0


def test_something_dark_that_lies_in_the_shadow_stays_dark(floor):
    places, colours, shade = floor
    base = np.hypot(places[:, 0] - 0.25, places[:, 1]) < 0.08
    colours = np.where(base[:, None], np.array([0.07, 0.07, 0.08]), colours)
    shaded, _ = without_shadow(flat(places, colours * shade[:, None]), FOOTPRINT, 0.0)
    assert not shaded[base].any()


def test_what_stands_or_lies_on_another_height_is_left_alone(floor):
    places, colours, shade = floor
    shaded, _ = without_shadow(flat(places, colours * shade[:, None], 0.3), FOOTPRINT, 0.0)
    assert not shaded.any()


def test_without_a_support_beside_there_is_nothing_to_go_by(floor):
    places, colours, shade = floor
    near = np.hypot(*places.T) < 0.3
    room = flat(places[near], (colours * shade[:, None])[near])
    assert not without_shadow(room, FOOTPRINT, 0.0)[0].any()
