"""Merged splats: fewer, in the same place, and the same picture where a pixel is a cell."""

import math

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.reduction import merged
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud

SIDE_PX = 40
RADIUS_M = 0.2


@pytest.fixture(scope="module")
def ball():
    """A striped ball of many small splats, finer than a pixel of its picture."""
    rng = np.random.default_rng(5)
    count = 6000
    outwards = rng.normal(size=(count, 3))
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    sh = (np.sign(np.sin(6 * outwards[:, 2:]))[:, None, :] * np.ones(3)) * 0.3 / SH_C0
    return SplatCloud(
        (RADIUS_M * outwards).astype(np.float32),
        np.full((count, 3), 0.006, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.9, np.float32),
        sh.astype(np.float32),
    )


def picture(cloud):
    camera = Pinhole.from_fov(SIDE_PX, SIDE_PX, math.radians(30))
    eye = look_at(np.array([0.9, 0.0, 0.3]), np.zeros(3))
    options = RenderOptions(antialias=True)
    drawn = NativeRenderer().render((PosedSplats(cloud, Pose.identity()),), camera, eye, options)
    return np.dstack([drawn.rgb, drawn.alpha])


def test_cells_of_a_pixel_change_a_picture_by_half_of_what_a_scan_is_off(ball):
    pixel_m = 2 * 0.95 * math.tan(math.radians(15)) / SIDE_PX
    fewer = merged(ball, pixel_m)
    assert len(fewer) < len(ball) / 2
    assert np.abs(picture(fewer) - picture(ball)).mean() < 0.035


def test_large_cells_change_it_more(ball):
    apart = [np.abs(picture(merged(ball, cell)) - picture(ball)).mean() for cell in (0.01, 0.1)]
    assert apart[1] > 3 * apart[0]


def test_moments_of_a_cell_are_kept(ball):
    one = merged(ball, 10.0)
    assert len(one) == 1
    np.testing.assert_allclose(one.means[0], ball.means.mean(axis=0), atol=1e-4)
    spread = np.cov(ball.means.T.astype(np.float64), bias=True) + 0.006**2 * np.eye(3)
    np.testing.assert_allclose(one.covariances()[0], spread, atol=1e-5)
    np.testing.assert_allclose(one.sh[0], ball.sh.mean(axis=0), atol=1e-4)


def test_rotations_are_unit_and_scales_are_sound(ball):
    flat = SplatCloud(
        ball.means * np.array([1, 1, 0], np.float32),
        ball.scales * np.array([1, 1, 1e-4], np.float32),
        ball.rotations,
        ball.opacities,
        ball.sh,
    )
    fewer = merged(flat, 0.05)
    np.testing.assert_allclose(np.linalg.norm(fewer.rotations, axis=1), 1.0, atol=1e-5)
    assert (fewer.scales > 0).all()
    assert (fewer.opacities <= 1).all()


def test_an_empty_cloud_stays_empty_and_a_cell_has_a_side(ball):
    nothing = ball.select(np.zeros(len(ball), dtype=bool))
    assert len(merged(nothing, 0.1)) == 0
    with pytest.raises(ValueError, match="cell_m: got 0"):
        merged(ball, 0.0)
