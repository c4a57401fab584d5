"""What of a drawing is kept: the native kernels and their numpy twins."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions
from scenes.splats import SplatCloud
from tracking import reduction
from tracking.kernels import looks_of, outlined_of

WINDOW = Fisheye(72, 56, 70.0, 33.0, 30.0, max_angle=math.radians(100))
SIGMA_M = 0.012


def cloud(count):
    """Speckled splats on a box of 30 cm."""
    rng = np.random.default_rng(4)
    means = rng.uniform(-0.15, 0.15, (count, 3))
    means[np.arange(count), rng.integers(0, 3, count)] = 0.15
    return SplatCloud(
        means.astype(np.float32),
        np.full((count, 3), SIGMA_M, np.float32),
        np.tile(np.float32([1.0, 0.0, 0.0, 0.0]), (count, 1)),
        np.full(count, 0.95, np.float32),
        rng.uniform(-1.0, 1.0, (count, 1, 3)).astype(np.float32),
    )


def drawing(finer, *, count=4000, away_m=0.9):
    """A drawing, its camera and `object_from_camera`."""
    world_from_camera = look_at(np.array([0.6, 0.7, 0.4]) * away_m, np.zeros(3))
    camera = WINDOW.resized(WINDOW.width_px * finer, WINDOW.height_px * finer)
    posed = PosedSplats(cloud(count), Pose.identity())
    options = RenderOptions(threads=1, antialias=True)
    drawn = NativeRenderer().render((posed,), camera, world_from_camera, options)
    return drawn, camera, world_from_camera


@pytest.mark.parametrize("finer", [1, 2, 4])
@pytest.mark.parametrize("away_m", [0.5, 0.9, 4.0], ids=["cut off", "whole", "small"])
def test_kernels_keep_what_their_twins_keep(finer, away_m):
    drawn, camera, object_from_camera = drawing(finer, away_m=away_m)
    found = outlined_of(drawn, camera, object_from_camera, finer=finer)
    wanted = reduction.outlined(drawn, camera, object_from_camera, finer=finer)
    assert found.part == wanted.part
    assert len(found.contour) >= 10
    for name in ("rgb", "alpha", "depth"):
        pictures = getattr(found.drawn, name), getattr(wanted.drawn, name)
        np.testing.assert_allclose(*pictures, atol=1e-5)
    np.testing.assert_allclose(found.pixels, wanted.pixels, atol=1e-4)
    for name in ("points", "normals", "inner_px", "outer_px"):
        values = getattr(found.contour, name), getattr(wanted.contour, name)
        np.testing.assert_allclose(*values, atol=1e-4)
    looks = looks_of(wanted, wanted.drawn, WINDOW, object_from_camera)
    twin = reduction.looks(wanted, wanted.drawn, WINDOW, object_from_camera)
    assert looks.area_px == twin.area_px > 0
    np.testing.assert_allclose(looks.contour.colours, twin.contour.colours, atol=1e-5)
    np.testing.assert_allclose(looks.surface, twin.surface, atol=1e-9)
    np.testing.assert_allclose(looks.colours, twin.colours, atol=1e-5)
    for name in ("points", "values", "slopes"):
        values = getattr(looks.texture, name), getattr(twin.texture, name)
        np.testing.assert_allclose(*values, atol=1e-5)


def test_texture_lies_on_the_side_that_is_seen():
    drawn, camera, object_from_camera = drawing(2)
    found = outlined_of(drawn, camera, object_from_camera, finer=2)
    looks = looks_of(found, found.drawn, WINDOW, object_from_camera)
    assert len(looks.texture) > 50
    on_a_side = np.abs(looks.texture.points - 0.15).min(axis=1)
    assert np.median(on_a_side) < 2.0 * SIGMA_M


def test_better_colours_are_those_that_are_kept():
    drawn, camera, object_from_camera = drawing(1)
    found = outlined_of(drawn, camera, object_from_camera, finer=1)
    grey = np.repeat(0.5 * found.drawn.alpha[..., None], 3, axis=2)
    better = Rendering(grey, found.drawn.alpha, found.drawn.depth)
    looks = looks_of(found, better, WINDOW, object_from_camera)
    middle = found.drawn.alpha[tuple(np.array(found.drawn.alpha.shape) // 2)]
    assert middle > 0.9
    assert abs(float(np.median(looks.colours)) - 0.5) < 0.01


def test_an_empty_drawing_has_no_points():
    empty = Rendering(
        np.zeros((56, 72, 3), np.float32),
        np.zeros((56, 72), np.float32),
        np.zeros((56, 72), np.float32),
    )
    found = outlined_of(empty, WINDOW, Pose.identity(), finer=1)
    assert found.part == reduction.outlined(empty, WINDOW, Pose.identity(), finer=1).part
    looks = looks_of(found, found.drawn, WINDOW, Pose.identity())
    assert (len(found.contour), len(looks.texture), len(looks.surface)) == (0, 0, 0)
    assert looks.area_px == 0
