"""The reference's own parts, against the camera models and finite differences."""

import numpy as np

from benchmarks.raster.reference import renderer as module
from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.splats import SplatCloud


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
    prints = module.footprints_of(cloud, pose, camera, module.RenderOptions())
    points = rng.multivariate_normal(cloud.means[0], cloud.covariances()[0], 100_000)
    pixels, _ = camera.project(pose @ points)
    wanted = np.cov(pixels.T) + 0.3 * np.eye(2)
    np.testing.assert_allclose(prints.covariances[0], wanted, rtol=0.02, atol=0.02)
