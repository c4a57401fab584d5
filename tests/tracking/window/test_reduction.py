"""Reduction of a rendering: the native kernels and their numpy twins."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.renderer import Rendering
from tests.tracking.solve.test_native_kernels import AXES_M, CHAIR, egg
from tests.twins import reduction
from tracking.window.reduction import looks_of, outlined_of

WINDOW = Fisheye(72, 56, 70.0, 33.0, 30.0, max_angle=math.radians(100))


def drawing(finer, *, away_m=1.8):
    """A drawing of an egg, its camera and `object_from_camera`."""
    aside = np.array([0.6, 0.7, 0.4]) * (away_m / math.hypot(0.6, 0.7, 0.4))
    world_from_camera = look_at(CHAIR + aside, CHAIR)
    camera = WINDOW.resized(WINDOW.width_px * finer, WINDOW.height_px * finer)
    return egg(camera, world_from_camera, Pose.identity()), camera, world_from_camera


def matched(one, other):
    """Indices of those points of two lists that lie at the same place."""
    apart = np.linalg.norm(one[:, None] - other[None], axis=2)
    both = np.flatnonzero(apart.min(axis=1) < 1e-4)
    return both, apart[both].argmin(axis=1)


@pytest.mark.parametrize("finer", [1, 2, 4])
@pytest.mark.parametrize("away_m", [0.8, 1.8, 6.0], ids=["cut off", "whole", "small"])
def test_kernels_keep_what_their_twins_keep(finer, away_m):
    drawn, camera, object_from_camera = drawing(finer, away_m=away_m)
    found = outlined_of(drawn, camera, object_from_camera, finer=finer)
    wanted = reduction.reduce_outline(drawn, camera, object_from_camera, finer=finer)
    assert found.part == wanted.part
    assert len(found.contour) >= 10
    for name in ("rgb", "alpha", "depth"):
        pictures = getattr(found.drawn, name), getattr(wanted.drawn, name)
        np.testing.assert_allclose(*pictures, atol=1e-5)
    # Where the contour is as steep as it is flat, rounding decides from which axis it is taken.
    both, same = matched(found.pixels, wanted.pixels)
    assert len(both) > 0.9 * max(len(found.contour), len(wanted.contour))
    for name in ("points", "normals", "inner_px", "outer_px"):
        values = getattr(found.contour, name)[both], getattr(wanted.contour, name)[same]
        np.testing.assert_allclose(*values, atol=1e-4)
    looks = looks_of(wanted, wanted.drawn, WINDOW, object_from_camera)
    twin = reduction.measure_looks(wanted, wanted.drawn, WINDOW, object_from_camera)
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
    for points in (looks.texture.points, looks.surface):
        from_middle = np.linalg.norm((points - CHAIR) / AXES_M, axis=1)
        np.testing.assert_allclose(from_middle, 1.0, atol=0.02)
        outwards, to_eye = (points - CHAIR) / AXES_M**2, object_from_camera.translation - points
        assert ((outwards * to_eye).sum(axis=1) > -0.05).all()


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
    assert found.part == reduction.reduce_outline(empty, WINDOW, Pose.identity(), finer=1).part
    looks = looks_of(found, found.drawn, WINDOW, Pose.identity())
    assert (len(found.contour), len(looks.texture), len(looks.surface)) == (0, 0, 0)
    assert looks.area_px == 0
