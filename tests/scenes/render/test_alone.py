"""A cloud that is drawn alone is compared with pictures as any renderer would draw it."""

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud
from tracking.kernels.native import Setting
from tracking.kernels.photometry import CLOSELY


def shrunk(picture, finer):
    """Means over squares of so many pixels each way."""
    height, width = picture.shape[:2]
    squares = picture.reshape(height // finer, finer, width // finer, finer, -1)
    means = squares.mean(axis=(1, 3)).astype(np.float32)
    return np.ascontiguousarray(means if picture.ndim == 3 else means[..., 0])


def thing_and_camera():
    """A few splats on the floor, what they are seen by, and two poses that they may have."""
    rng = np.random.default_rng(8)
    means = rng.uniform([-0.2, -0.2, 0.0], [0.2, 0.2, 0.4], (40, 3))
    cloud = SplatCloud(
        means.astype(np.float32),
        np.full((40, 3), 0.05, np.float32),
        np.tile(np.float32([1.0, 0.0, 0.0, 0.0]), (40, 1)),
        np.full(40, 0.9, np.float32),
        rng.uniform(-0.5, 1.0, (40, 4, 3)).astype(np.float32),
    )
    camera = Fisheye(40, 30, 60.0, 21.0, 14.0, max_angle=0.5)
    world_from_camera = look_at(np.array([0.5, -2.0, 1.1]), np.array([0.0, 0.0, 0.2]))
    return cloud, camera, world_from_camera, [(0.0, 0.0, 0.0, 0.0), (0.1, -0.1, 0.05, 2.4)]


@pytest.mark.parametrize("finer", [1, 2, 3])
def test_a_cloud_is_compared_as_it_is_drawn(finer):
    cloud, camera, world_from_camera, upright = thing_and_camera()
    renderer, options = NativeRenderer(), RenderOptions(threads=1, antialias=True)
    rng = np.random.default_rng(9)
    live, empty = rng.uniform(0.2, 0.8, (2, 30, 40, 3)).astype(np.float32)
    kernel = Setting(
        live, empty, np.ones((30, 40), np.float32), size=(40, 30), constants=CLOSELY.for_native()
    )
    fine = camera.resized(40 * finer, 30 * finer)
    alone = renderer.alone(cloud, fine, world_from_camera, options)
    strange, alike = kernel.strange_at(alone, upright), kernel.resemblance_at(alone, upright)
    for index, (x, y, z, yaw) in enumerate(upright):
        posed = PosedSplats(cloud, Pose.from_yaw(yaw, (x, y, z)))
        drawn = renderer.render((posed,), fine, world_from_camera, options)
        seen = [shrunk(picture, finer) for picture in (drawn.rgb, drawn.alpha)]
        assert seen[1].max() > 0.5
        assert strange[index] == pytest.approx(kernel.strange(*seen), rel=1e-4)
        assert alike[index] == pytest.approx(kernel.resemblance(*seen), rel=1e-3, abs=1e-5)


def test_a_drawing_that_no_whole_pixels_make_is_refused():
    cloud, camera, world_from_camera, upright = thing_and_camera()
    alone = NativeRenderer().alone(cloud, camera, world_from_camera, RenderOptions())
    picture, free = np.zeros((20, 30, 3), np.float32), np.zeros((20, 30), np.float32)
    kernel = Setting(picture, picture, free, size=(30, 20), constants=CLOSELY.for_native())
    with pytest.raises(ValueError, match=r"alone: drawn with \[40, 30\] px, wanted a whole mult"):
        kernel.resemblance_at(alone, upright)
