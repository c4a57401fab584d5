"""Projections of the reference against the camera models and finite differences."""

import numpy as np
import pytest

from benchmarks.raster.reference.projection import project, undo_projection
from scenes.cameras import Fisheye, Pinhole

PINHOLE = Pinhole(200, 150, 180.0, 170.0, 90.0, 80.0)
FISHEYE = Fisheye.from_fov(200, np.radians(240))
DISTORTED = Fisheye(200, 190, 60.0, 90.0, 99.0, np.radians(115), (-0.05, 0.01, -0.004, 0.0006))


def points_in_view(camera, count=200):
    rng = np.random.default_rng(0)
    pixels = rng.uniform([0, 0], [camera.width_px, camera.height_px], (count, 2))
    rays = camera.unproject(pixels)
    points = rays * rng.uniform(0.5, 5.0, (count, 1))
    return points[camera.project(points)[1]]


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE, DISTORTED])
def test_projection_is_the_cameras(camera):
    points = points_in_view(camera)
    pixels, depths, jacobians, drawable = project(camera, points)
    np.testing.assert_allclose(pixels, camera.project(points)[0], atol=1e-9)
    assert drawable.all()
    wanted = points[:, 2] if isinstance(camera, Pinhole) else np.linalg.norm(points, axis=1)
    np.testing.assert_allclose(depths, wanted)
    step = 1e-6
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        numeric = (camera.project(points + shift)[0] - camera.project(points - shift)[0]) / (
            2 * step
        )
        np.testing.assert_allclose(jacobians[:, :, axis], numeric, rtol=1e-5, atol=1e-4)


def test_the_axis_of_a_fisheye_is_not_special():
    points = np.array([[0.0, 0.0, 2.0], [1e-9, 0.0, 2.0], [0.0, -1e-9, 2.0]])
    _, _, jacobians, drawable = project(FISHEYE, points)
    assert drawable.all()
    np.testing.assert_allclose(jacobians, np.repeat(jacobians[:1], 3, axis=0), atol=1e-6)
    np.testing.assert_allclose(jacobians[0, :, :2], FISHEYE.f_px / 2.0 * np.eye(2))


def test_the_pinhole_jacobian_is_frozen_outside_the_margin():
    edge = (200 + 0.15 * 200 - 90.0) / 180.0
    points = np.array([[edge, 0.0, 1.0], [4 * edge, 0.0, 1.0]])
    _, _, jacobians, _ = project(PINHOLE, points)
    np.testing.assert_allclose(jacobians[1], jacobians[0])


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE, DISTORTED])
def test_gradients_of_points_are_those_of_small_steps(camera):
    rng = np.random.default_rng(3)
    points = points_in_view(camera, 40)
    d_pixels, d_depths = rng.normal(size=(len(points), 2)), rng.normal(size=len(points))
    d_jacobians = rng.normal(size=(len(points), 2, 3))

    def loss(at):
        pixels, depths, jacobians, _ = project(camera, at)
        return (
            (pixels * d_pixels).sum(axis=1)
            + depths * d_depths
            + (jacobians * d_jacobians).sum(axis=(1, 2))
        )

    found = undo_projection(camera, points, d_pixels, d_depths, d_jacobians)
    for axis in range(3):
        shift = 1e-6 * np.eye(3)[axis]
        numeric = (loss(points + shift) - loss(points - shift)) / 2e-6
        np.testing.assert_allclose(found[:, axis], numeric, rtol=1e-5, atol=1e-3)
