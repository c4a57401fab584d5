"""A box with stray splats of its own colour beside it, walked around."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package_records import ViewPoint
from scenes.prepare.cutout.seen_surface import MOST_PX, cropped, seen_surface
from scenes.prepare.cutout.upright_box import upright_box
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud, concatenate

CAMERA = Pinhole(320, 240, 280.0, 280.0, 160.0, 120.0)
SIZE = np.array([0.3, 0.2, 0.4])
CENTRE = np.array([0.0, 0.0, 0.2])
STEP_M = 0.015


def flat(points, thin, colour, opacity=0.95):
    n = len(points)
    scales = np.full((n, 3), 0.7 * STEP_M)
    scales[np.arange(n), thin] = 0.001
    sh = np.tile((np.asarray(colour, dtype=np.float32) - 0.5) / 0.2820948, (n, 1, 1))
    turns = np.tile([1.0, 0, 0, 0], (n, 1))
    return SplatCloud(points, scales, turns, np.full(n, opacity), sh)


def grid(low, high, axis, at):
    lines = [np.arange(low[a] + STEP_M / 2, high[a], STEP_M) for a in range(3)]
    lines[axis] = np.array([at])
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.fixture(scope="module")
def room():
    """The splats of a floor, a box and strays, and which the cut took for the box's."""
    low, high = CENTRE - SIZE / 2, CENTRE + SIZE / 2
    level = grid((-0.9, -0.9, 0), (0.9, 0.9, 0), 2, 0.0)
    under = ((level > low) & (level < high))[:, :2].all(axis=1)
    floor = flat(level[~under], 2, (0.7, 0.65, 0.6))
    faces = [
        flat(grid(low, high, axis, end[axis]), axis, (0.7, 0.25, 0.2))
        for axis in range(3)
        for end in (low, high)
    ]
    rng = np.random.default_rng(6)
    air = rng.uniform((-0.4, -0.4, 0.1), (0.4, 0.4, 0.6), (60, 3))
    strays = flat(air, 2, (0.7, 0.25, 0.2), opacity=0.5)
    parts = [floor, *faces, strays]
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
    beyond = np.abs(surface.thing - CENTRE) - SIZE / 2
    assert np.percentile(np.abs(beyond.max(axis=1)), 98) < 0.012
    assert np.percentile(np.abs(surface.around[:, 2]), 98) < 0.01


def test_few_views_say_nothing_nor_do_those_that_cut_the_thing_off(room):
    cloud, taken = room
    close_up = Pinhole(320, 240, 1200.0, 1200.0, 160.0, 120.0)
    for views in (walk(5), walk(16, camera=close_up), ()):
        surface = seen_surface(cloud, taken, views, renderer=NativeRenderer())
        assert (len(surface.thing), len(surface.around)) == (0, 0)


@settings(max_examples=20, deadline=None)
@given(turn=st.floats(0, 6.28), far=st.floats(1.0, 6.0), high=st.floats(-0.5, 1.5))
def test_a_crop_sees_the_same_points_larger_or_smaller(turn, far, high):
    eye = np.array([far * np.cos(turn), far * np.sin(turn), 0.2 + high])
    world_from_camera = look_at(eye, CENTRE)
    points = CENTRE + np.random.default_rng(1).uniform(-0.5, 0.5, (200, 3)) * SIZE
    camera = Pinhole(1280, 960, 900.0, 900.0, 640.0, 480.0)
    crop = cropped(camera, world_from_camera, points)
    assert crop is not None
    assert max(crop.width_px, crop.height_px) <= MOST_PX
    in_camera = world_from_camera.inverse() @ points
    pixels, valid = crop.project(in_camera)
    assert valid.all()
    whole, _ = camera.project(in_camera)
    scale = crop.fx / camera.fx
    np.testing.assert_allclose(np.diff(pixels, axis=0), scale * np.diff(whole, axis=0), atol=1e-6)
    assert cropped(camera, world_from_camera, points + world_from_camera.rotation[:, 0] * 9) is None
