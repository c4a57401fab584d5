"""A box with stray splats of its own colour beside it, walked around."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.object.upright_box import upright_box
from scenes.prepare.cutout.votes.seen_surface import seen_surface
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate

CAMERA = Pinhole(320, 240, 280.0, 280.0, 160.0, 120.0)
SIZE = np.array([0.3, 0.2, 0.4])
CENTRE = np.array([0.0, 0.0, 0.2])
STEP_M = 0.015


@pytest.fixture(scope="module")
def room(box_on_floor, flat_splats):
    """The splats of a floor, a box and strays, and which the cut took for the box's."""
    floor, box = box_on_floor(SIZE, floor_m=0.9, step_m=STEP_M)
    rng = np.random.default_rng(6)
    air = rng.uniform((-0.4, -0.4, 0.1), (0.4, 0.4, 0.6), (60, 3))
    strays = flat_splats(air, 2, (0.7, 0.25, 0.2), step_m=STEP_M, opacity=0.5)
    parts = [floor, box, strays]
    return concatenate(parts), np.arange(sum(map(len, parts))) >= len(floor)


def walk(count, *, camera=CAMERA):
    turns = np.linspace(0, 2 * np.pi, count, endpoint=False) + 0.15
    eyes = [
        np.array([1.3 * np.cos(a), 1.3 * np.sin(a), 0.55 + 0.3 * (k % 2)])
        for k, a in enumerate(turns)
    ]
    return tuple(ViewPoint(f"{k}", camera, look_at(eye, CENTRE)) for k, eye in enumerate(eyes))


def test_strays_that_no_views_agree_about_do_not_move_the_box(room):
    cloud, taken = room
    own, rest = cloud.select(taken), cloud.select(~taken)
    loose = upright_box(own, rest)
    assert max(loose.size_m[:2]) > 0.45
    surface = seen_surface(cloud, taken, walk(16), renderer=NativeRenderer())
    firm = upright_box(own, rest, surface)
    np.testing.assert_allclose(sorted(firm.size_m), sorted(SIZE), atol=0.02)
    np.testing.assert_allclose(firm.world_from_box.translation, (0, 0, 0), atol=0.01)
    assert firm.supported
    turned = (firm.world_from_box.yaw() + np.pi / 4) % (np.pi / 2) - np.pi / 4
    assert abs(turned) < np.deg2rad(2)


def test_points_lie_on_the_surfaces(room):
    cloud, taken = room
    surface = seen_surface(cloud, taken, walk(16), renderer=NativeRenderer())
    beyond = np.abs(surface.own - CENTRE) - SIZE / 2
    assert np.percentile(np.abs(beyond.max(axis=1)), 98) < 0.012
    assert np.percentile(np.abs(surface.around[:, 2]), 98) < 0.01


def test_few_views_say_nothing_nor_do_those_that_cut_the_thing_off(room):
    cloud, taken = room
    close_up = Pinhole(320, 240, 1200.0, 1200.0, 160.0, 120.0)
    for views in (walk(5), walk(16, camera=close_up), ()):
        surface = seen_surface(cloud, taken, views, renderer=NativeRenderer())
        assert (len(surface.own), len(surface.around)) == (0, 0)
