"""Drawings reduced to points: true to what was drawn, and used while they serve."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from tracking.evidence.evidence import Evidence
from tracking.evidence.rendering import RenderingCache, draw, reduced_rendering
from tracking.kernels.native import SeenWindow
from tracking.model.object_model import make_model
from tracking.solve.gauss_newton import ROUGH_POINTS, roughly
from tracking.window.window import window_around

LENS = Fisheye.from_fov(1000, math.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
BOX_M = (0.3, 0.2, 0.1)


def box():
    rng = np.random.default_rng(1)
    means = rng.uniform(-0.5, 0.5, (4000, 3))
    axis = rng.integers(0, 3, 4000)
    means[np.arange(4000), axis] = rng.choice([-0.5, 0.5], 4000)
    means = means * BOX_M + np.array([0, 0, 0.5 * BOX_M[2]])
    return SplatCloud(
        means.astype(np.float32),
        np.full((4000, 3), 0.004, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (4000, 1)),
        np.full(4000, 0.95, np.float32),
        rng.uniform(-1, 1, (4000, 1, 3)).astype(np.float32),
    )


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


@pytest.fixture(scope="module")
def model(renderer):
    return make_model(ObjectModel("b", "box", "", box(), BOX_M, 0.0, Pose.identity()), renderer)


def seen(model, world_from_object):
    """Evidence of a window in which nothing is known yet."""
    window = window_around(
        RIG, Pose.identity(), model.centre_at(world_from_object), radius_m=model.radius_m
    )
    shape = (window.camera.height_px, window.camera.width_px)
    empty = np.zeros(shape, np.float32)
    live = np.zeros((*shape, 3), np.float32)
    native = SeenWindow(live, empty, empty, empty, (shape[1], shape[0]))
    return Evidence(window, live, empty, empty, empty, (), native)


def at(x, y, z, yaw_deg=0.0):
    tilt = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # up is the camera's -y
    return Pose(tilt @ Pose.from_yaw(math.radians(yaw_deg)).rotation, np.array([x, y, z]))


@pytest.mark.parametrize(("distance_m", "finer"), [(0.5, 2), (1.2, 3), (3.0, 4)])
def test_small_objects_are_drawn_finer_and_their_points_lie_where_they_should(
    model, renderer, distance_m, finer
):
    pose = at(0.1, 0.3, distance_m, 20.0)
    evidence = seen(model, pose)
    reduced = reduced_rendering(model, pose, evidence, renderer)
    assert reduced.finer == finer
    inside = pose.inverse() @ evidence.world_from_camera
    np.testing.assert_allclose((inside @ reduced.camera_from_object).matrix(), np.eye(4), atol=1e-9)
    low, high = np.array([-0.5, -0.5, 0.0]) * BOX_M, np.array([0.5, 0.5, 1.0]) * BOX_M
    for points in (reduced.contour.points, reduced.surface):
        assert (points > low - 0.02).all()
        assert (points < high + 0.02).all()
    pixels, _ = evidence.camera.project(reduced.camera_from_object @ reduced.surface)
    column, row = np.floor(pixels).astype(int).T
    alpha = draw(model, pose, evidence, renderer).alpha
    assert (alpha[row, column] > 0.3).mean() > 0.97
    assert (reduced.contour.inner_px <= 6.0).all()


def test_a_reduced_rendering_serves_until_the_object_looks_otherwise(model, renderer):
    pose = at(0.0, 0.2, 1.5)
    reduced = reduced_rendering(model, pose, seen(model, pose), renderer)

    def is_valid_for(x, y, z, yaw_deg=0.0):
        moved = at(x, y, z, yaw_deg)
        view = seen(model, moved).view
        return reduced.is_valid_for(view, view.world_from_camera.inverse() @ moved)

    assert is_valid_for(0.0, 0.2, 1.5)
    assert is_valid_for(0.01, 0.2, 1.51, 0.5)
    assert not is_valid_for(0.0, 0.2, 1.5, 3.0)
    assert not is_valid_for(0.0, 0.2, 1.7)
    assert not is_valid_for(0.15, 0.2, 1.5)
    assert not is_valid_for(0.0, 0.2, -1.5)


def test_what_a_cache_has_drawn_serves_again_and_a_rough_one_only_to_come_near_by(model, renderer):
    pose, turned = at(0.0, 0.2, 1.5), at(0.0, 0.2, 1.5, 3.0)
    cache = RenderingCache()
    first = cache.at(model, pose, seen(model, pose), renderer)
    assert cache.at(model, turned, seen(model, turned), renderer, tolerance=2.5) is first
    second = cache.at(model, turned, seen(model, turned), renderer)
    assert second is not first
    assert cache.at(model, pose, seen(model, pose), renderer) is first
    assert RenderingCache(second).at(model, turned, seen(model, turned), renderer) is second


def test_what_moves_on_is_drawn_quickly_until_it_is_looked_at_closely(model, renderer):
    pose = Pose.from_yaw(0.3, (0.1, 0.1, 0.5))
    evidence = seen(model, pose)
    quick = RenderingCache(quickly=True).at(model, pose, evidence, renderer)
    close = RenderingCache(quick).at(model, pose, evidence, renderer)
    assert (quick.finer, close.finer) == (1, 2)
    assert RenderingCache(close, quickly=True).at(model, pose, evidence, renderer) is close


def test_far_off_an_outline_is_looked_at_in_fewer_points(model, renderer):
    pose = Pose.from_yaw(0.3, (0.2, 0.1, 1.0))
    outline = reduced_rendering(model, pose, seen(model, pose), renderer).contour
    few = roughly(outline)
    assert ROUGH_POINTS <= len(few) < 2 * ROUGH_POINTS
    step = len(outline) // ROUGH_POINTS
    np.testing.assert_array_equal(few.points, outline.points[::step])
    np.testing.assert_array_equal(few.normals, outline.normals[::step])
    assert roughly(few).points.shape == few.points.shape
