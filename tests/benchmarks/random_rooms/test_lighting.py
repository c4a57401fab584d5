"""`benchmarks.random_rooms.lighting`: lamps, shadows, corners, another day."""

import numpy as np
import pytest

from benchmarks.random_rooms.lighting import room_light
from scenes.samples.light import AreaLight
from scenes.samples.pictures.textures import plain
from scenes.samples.shapes import box, quad

GREY = plain((128, 128, 128))


@pytest.fixture(scope="module")
def light():
    floor = quad((-2, 2, 0), (4, 0, 0), (0, -4, 0), material=GREY)
    wall = quad((-2, 2, 2.5), (4, 0, 0), (0, 0, -2.5), material=GREY)
    block = box((0.5, -0.5, 0.0), (1.5, 0.5, 0.8), material=GREY)
    lamp = AreaLight(
        np.array([-0.2, -0.2, 2.4]), np.array([0.0, 0.4, 0.0]), np.array([0.4, 0.0, 0.0]), (8, 8, 8)
    )
    rng = np.random.default_rng(1)
    return room_light([floor, wall, *block], [lamp], rng, level=0.8)


def at(light, x, y):
    near = np.linalg.norm(
        light.texels.centres[: np.prod(light.texels.shapes[0])] - (x, y, 0), axis=1
    )
    total = light.sources.sum(axis=0) * light.exposure
    return float(total[near.argmin()].mean())


def test_the_floor_is_as_bright_as_asked(light):
    floor = np.prod(light.texels.shapes[0])
    mean = (light.sources.sum(axis=0) * light.exposure)[:floor].mean()
    assert mean == pytest.approx(0.604, rel=0.2)  # sRGB 0.8 as linear light


def test_a_block_casts_a_shadow(light):
    assert at(light, 1.7, 0.0) < 0.75 * at(light, -1.7, 0.0)


def test_under_a_wall_it_is_darker_than_in_the_open(light):
    around = light.sources[0, : np.prod(light.texels.shapes[0])].mean(axis=1)
    centres = light.texels.centres[: len(around)]
    assert around[centres[:, 1] > 1.9].mean() < 0.85 * around[np.abs(centres[:, 1]) < 0.3].max()


def test_a_brighter_lamp_makes_a_brighter_mesh(light):
    usual, bright = (light.mesh(np.full((1, 3), gain)).texture for gain in (1.0, 1.3))
    assert bright.astype(float).mean() > usual.astype(float).mean() + 1.0
