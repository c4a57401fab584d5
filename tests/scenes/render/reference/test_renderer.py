"""The reference's own parts, against the camera models and finite differences."""

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.reference import renderer as module
from scenes.splats import SplatCloud

PINHOLE = Pinhole(200, 150, 180.0, 170.0, 90.0, 80.0)
FISHEYE = Fisheye.from_fov(200, np.radians(240))
DISTORTED = Fisheye(200, 190, 60.0, 90.0, 99.0, np.radians(115), (-0.05, 0.01, -0.004, 0.0006))


def points_in_view(camera, count=200):
    rng = np.random.default_rng(0)
    pixels = rng.uniform([0, 0], [camera.width_px, camera.height_px], (count, 2))
    rays = camera.unproject(pixels)
    points = rays * rng.uniform(0.5, 5.0, (count, 1))
    return points[camera.project(points)[1]]


@pytest.mark.parametrize(
    ("camera", "project"),
    [
        (PINHOLE, module._project_pinhole),
        (FISHEYE, module._project_fisheye),
        (DISTORTED, module._project_fisheye),
    ],
)
def test_projection_is_the_cameras(camera, project):
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
    _, _, jacobians, drawable = module._project_fisheye(FISHEYE, points)
    assert drawable.all()
    np.testing.assert_allclose(jacobians, np.repeat(jacobians[:1], 3, axis=0), atol=1e-6)
    np.testing.assert_allclose(jacobians[0, :, :2], FISHEYE.f_px / 2.0 * np.eye(2))


def test_the_pinhole_jacobian_is_frozen_outside_the_margin():
    edge = (200 + 0.15 * 200 - 90.0) / 180.0
    points = np.array([[edge, 0.0, 1.0], [4 * edge, 0.0, 1.0]])
    _, _, jacobians, _ = module._project_pinhole(PINHOLE, points)
    np.testing.assert_allclose(jacobians[1], jacobians[0])


def test_a_small_splat_covers_what_its_points_cover():
    """EWA's covariance is that of many points drawn from the splat and projected one by one."""
    rng = np.random.default_rng(2)
    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    cloud = SplatCloud(
        np.array([[0.4, 0.3, -0.2]], dtype=np.float32),
        np.array([[0.02, 0.005, 0.01]], dtype=np.float32),
        quaternion[None].astype(np.float32),
        np.ones(1, dtype=np.float32),
        np.zeros((1, 1, 3), dtype=np.float32),
    )
    camera = Fisheye.from_fov(600, np.radians(240))
    pose = Pose.from_yaw(0.5)
    prints = module._footprints(cloud, pose, camera, module.RenderOptions())
    points = rng.multivariate_normal(cloud.means[0], cloud.covariances()[0], 100_000)
    pixels, _ = camera.project(pose @ points)
    wanted = np.cov(pixels.T) + 0.3 * np.eye(2)
    np.testing.assert_allclose(prints.covariances[0], wanted, rtol=0.02, atol=0.02)
