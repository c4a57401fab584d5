import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.reduction import thinned
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud


@pytest.fixture
def wall():
    """A wall of 2 m of 8000 flat splats in a smooth pattern."""
    rng = np.random.default_rng(3)
    means = np.concatenate([rng.uniform(-1, 1, (8000, 2)), np.zeros((8000, 1))], axis=1)
    colours = np.sin(4 * means[:, [0, 1, 0]] * [1, 1, 2])[:, None, :]
    return SplatCloud(
        means.astype(np.float32),
        np.tile(np.array([0.03, 0.03, 0.003], np.float32), (8000, 1)),
        np.tile(np.array([1, 0, 0, 0], np.float32), (8000, 1)),
        np.full(8000, 0.8, np.float32),
        colours.astype(np.float32),
    )


def picture(cloud):
    camera = Pinhole.from_fov(160, 120, 0.8)
    pose = look_at(np.array([0.1, -0.1, 1.7]), np.zeros(3))
    return NativeRenderer().render([PosedSplats(cloud, Pose.identity())], camera, pose)


def test_a_thinned_wall_has_no_holes(wall):
    whole, thin = picture(wall), picture(thinned(wall, 2000))
    assert thin.alpha.min() > 0.9
    assert np.sqrt(((whole.rgb - thin.rgb) ** 2).mean()) < 0.05


def test_density_stays_even(wall):
    thin = thinned(wall, 1000)
    assert len(thin) == 1000
    counts = [
        np.histogram2d(cloud.means[:, 0], cloud.means[:, 1], bins=4)[0] for cloud in (wall, thin)
    ]
    assert np.abs(counts[1] / counts[0] * 8 - 1).max() < 0.1


def test_a_small_cloud_stays_as_it_is(wall):
    assert thinned(wall, 8000) is wall
    empty = wall.select(np.zeros(0, np.intp))
    assert thinned(empty, 5) is empty


def test_splats_nowhere_are_left_out(wall):
    means = wall.means.copy()
    means[::2] = np.nan
    odd = SplatCloud(means, wall.scales, wall.rotations, wall.opacities, wall.sh)
    assert np.isfinite(thinned(odd, 1000).means).all()
    assert len(thinned(odd, 1000)) == 1000
    means[:] = np.inf
    lost = SplatCloud(means, wall.scales, wall.rotations, wall.opacities, wall.sh)
    assert len(thinned(lost, 1000)) == 0


def test_no_splats_at_all_are_refused(wall):
    with pytest.raises(ValueError, match="count: got 0, wanted at least 1"):
        thinned(wall, 0)
