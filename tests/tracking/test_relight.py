"""Objects in another room's light: what of it a picture tells, and what it does not forgive."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Fisheye
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud
from tracking.pictures import bell_blurred
from tracking.relight import FOOT, LIGHT_RANGE, Light, LitView, shell_of
from tracking.resemblance import LENS_BLUR_PX, LENS_REACH_PX

SIDE_M, STEP_M = 0.2, 0.01
CAMERA = Fisheye(56, 56, 200.0, 28.0, 28.0, max_angle=0.5)
TRUE = Pose.from_yaw(0.6, (0.1, 0.2, 0.0))
WORLD_FROM_CAMERA = look_at(np.array([0.7, -0.7, 0.8]), np.array([0.1, 0.2, 0.1]))


def a_box():
    """A cube of flat splats, speckled, on the floor."""
    rng = np.random.default_rng(4)
    steps = np.arange(STEP_M / 2, SIDE_M, STEP_M) - SIDE_M / 2
    across, along = (axis.ravel() for axis in np.meshgrid(steps, steps))
    count, half = len(across), np.full(len(across), SIDE_M / 2)
    means, scales = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            points = np.insert(np.stack([across, along], axis=1), axis, side * half, axis=1)
            means.append(points + np.array([0.0, 0.0, SIDE_M / 2]))
            scales.append(np.insert(np.full((count, 2), 0.7 * STEP_M), axis, 0.001, axis=1))
    total = 6 * count
    colours = rng.uniform(0.2, 0.5, (total, 1, 3))
    cloud = SplatCloud(
        np.concatenate(means).astype(np.float32),
        np.concatenate(scales).astype(np.float32),
        np.tile(np.float32([1.0, 0.0, 0.0, 0.0]), (total, 1)),
        np.full(total, 0.95, np.float32),
        ((colours - 0.5) / SH_C0).astype(np.float32),
    )
    return SimpleNamespace(splats=cloud, box_m=(SIDE_M, SIDE_M, SIDE_M))


@pytest.fixture(scope="module")
def seen():
    """A box, its shell, and a renderer."""
    source = a_box()
    return source, shell_of(source), NativeRenderer()


def drawn(renderer, cloud):
    options = RenderOptions(threads=1, antialias=True)
    picture = renderer.render((PosedSplats(cloud, TRUE),), CAMERA, WORLD_FROM_CAMERA, options)
    blurred = (bell_blurred(p, LENS_BLUR_PX, LENS_REACH_PX) for p in (picture.rgb, picture.alpha))
    return tuple(blurred)


def test_sides_face_outwards_and_the_foot_is_left_out(seen):
    source, shell, _ = seen
    assert shell.splats.means[:, 2].min() > FOOT * SIDE_M
    # Its underside is a sixth of a cube.
    assert len(shell.splats) > 0.75 * len(source.splats)
    from_centre = shell.splats.means - np.array([0.0, 0.0, SIDE_M / 2])
    axis = np.abs(from_centre).argmax(axis=1)
    rows = np.arange(len(axis))
    is_inner = np.sort(np.abs(from_centre), axis=1)[:, 1] < SIDE_M / 2 - 2 * STEP_M
    outwards = shell.facing[rows, axis] * np.sign(from_centre[rows, axis])
    assert outwards[is_inner].min() > 0.99
    np.testing.assert_allclose(
        shell.compass.colours(), 0.5 + 0.5 * shell.facing, atol=1e-5, rtol=0.0
    )


def test_a_picture_tells_the_light_that_it_was_made_in(seen):
    _, shell, renderer = seen
    light = Light(np.array([1.2, -0.3, 0.4, 0.5]), np.array([0.06, 0.0, -0.06]))
    gains = light.gains(shell.facing)
    sh = shell.splats.sh * gains[:, None, :]
    sh[:, 0] += (gains - 1.0) * (0.5 / SH_C0)
    lit = SplatCloud(
        shell.splats.means, shell.splats.scales, shell.splats.rotations, shell.splats.opacities, sh
    )
    rgb, alpha = drawn(renderer, lit)
    empty = np.full((56, 56, 3), 0.5, np.float32)
    live = rgb + (1.0 - alpha)[..., None] * empty
    view = LitView(live, empty, np.ones_like(alpha), CAMERA, WORLD_FROM_CAMERA, renderer)
    found, _ = drawn(renderer, view.relit(shell, TRUE))
    inside = alpha > 0.95
    assert inside.sum() > 500
    assert np.abs(found - rgb)[inside].mean() < 0.01
    scanned, _ = drawn(renderer, shell.splats)
    assert np.abs(scanned - rgb)[inside].mean() > 0.08
    quick, _ = view.lit(shell, TRUE)
    assert np.abs(quick - rgb)[inside].mean() < 0.03


def test_light_is_not_made_to_print_anything(seen):
    _, shell, renderer = seen
    rgb, alpha = drawn(renderer, shell.splats)
    empty = np.full((56, 56, 3), 0.5, np.float32)
    stripes = np.where(np.arange(56) // 4 % 2, 1.5, 0.6).astype(np.float32)[:, None]
    live = stripes * rgb + (1.0 - alpha)[..., None] * empty
    view = LitView(live, empty, np.ones_like(alpha), CAMERA, WORLD_FROM_CAMERA, renderer)
    found, _ = drawn(renderer, view.relit(shell, TRUE))
    inside = alpha > 0.95
    assert np.abs(found - live)[inside].mean() > 0.08


def test_what_is_not_in_the_picture_keeps_a_light_that_can_be(seen):
    _, shell, renderer = seen
    black = np.zeros((56, 56, 3), np.float32)
    view = LitView(black, black, np.zeros((56, 56), np.float32), CAMERA, TRUE, renderer)
    assert np.isfinite(view.relit(shell, TRUE).sh).all()


@given(st.lists(st.floats(-9, 9), min_size=7, max_size=7), st.floats(0, 6.28))
def test_gains_are_within_what_light_can_do(light, turn):
    facing = np.array([[np.cos(turn), np.sin(turn), 0.0]])
    gains = Light(np.array(light[:4]), np.array(light[4:])).gains(facing)
    assert gains.shape == (1, 3)
    low, high = LIGHT_RANGE
    assert (gains >= np.float32(low)).all()
    assert (gains <= np.float32(high)).all()
