"""A box with splats beside it that hang in the air and have the floor's colour."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.remainder.see_through import shows_background
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate
from tests.scenes.prepare.cutout.conftest import COLOUR_OF_BOX, COLOUR_OF_FLOOR

CAMERA = Pinhole(240, 180, 210.0, 210.0, 120.0, 90.0)
SIZE = np.array([0.3, 0.2, 0.3])
STEP_M = 0.015


def walk(count):
    turns = np.linspace(0, 2 * np.pi, count, endpoint=False) + 0.15
    eyes = [np.array([1.2 * np.cos(a), 1.2 * np.sin(a), 1.0]) for a in turns]
    return tuple(
        ViewPoint(f"{k}", CAMERA, look_at(eye, np.array([0.0, 0.0, 0.1])))
        for k, eye in enumerate(eyes)
    )


@pytest.fixture(scope="module")
def room(box_on_floor, flat_splats):
    """Makes all splats, which of them the cut took for the box's, and which hang beside it."""

    def made(colour_beside):
        floor, box = box_on_floor(SIZE, floor_m=1.2, step_m=STEP_M)
        out, up = np.meshgrid(np.arange(0.27, 0.4, STEP_M), np.arange(0.05, 0.15, STEP_M))
        air = np.stack([out.ravel(), np.zeros(out.size), up.ravel()], axis=1)
        beside = flat_splats(air, 1, colour_beside, step_m=STEP_M)
        place = np.arange(len(floor) + len(box) + len(beside))
        return (
            concatenate([floor, box, beside]),
            place >= len(floor),
            place >= len(floor) + len(box),
        )

    return made


def test_splats_of_the_colour_behind_show_it_and_no_others(room):
    cloud, taken, beside = room(COLOUR_OF_FLOOR)
    through = shows_background(cloud, taken, walk(12), renderer=NativeRenderer())
    assert through[beside].mean() > 0.9
    assert through[taken & ~beside].mean() < 0.02
    assert not through[~taken].any()


def test_splats_of_the_things_own_colour_stay(room):
    cloud, taken, _ = room(COLOUR_OF_BOX)
    assert not shows_background(cloud, taken, walk(12), renderer=NativeRenderer()).any()


def test_a_thing_that_looks_like_the_floor_is_left_whole(room):
    cloud, taken, _ = room(COLOUR_OF_FLOOR)
    sh = cloud.sh.copy()
    sh[taken] = cloud.sh[np.flatnonzero(~taken)[0]]
    same = type(cloud)(cloud.means, cloud.scales, cloud.rotations, cloud.opacities, sh)
    assert not shows_background(same, taken, walk(12), renderer=NativeRenderer()).any()


def test_few_views_say_nothing(room):
    cloud, taken, _ = room(COLOUR_OF_FLOOR)
    assert not shows_background(cloud, taken, walk(2), renderer=NativeRenderer()).any()
