"""Which splats may show in a picture, against the picture."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.cutout.votes.framed import framed
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud

EYE = np.array([0.2, -0.1, 0.3])


def scattered(count=3000):
    """Splats all around the camera, small ones and wide ones."""
    rng = np.random.default_rng(1)
    turns = rng.normal(size=(count, 4))
    return SplatCloud(
        rng.uniform(-4, 4, (count, 3)).astype(np.float32),
        np.exp(rng.uniform(-5, -1.5, (count, 3))).astype(np.float32),
        (turns / np.linalg.norm(turns, axis=1, keepdims=True)).astype(np.float32),
        rng.uniform(0.1, 1.0, count).astype(np.float32),
        rng.normal(size=(count, 1, 3)).astype(np.float32),
    )


@pytest.mark.parametrize("middle", [(60.0, 45.0), (400.0, -200.0)])
def test_a_crop_is_drawn_the_same_without_the_others(middle):
    cloud = scattered()
    camera = Pinhole(120, 90, 200.0, 200.0, *middle)
    pose = look_at(EYE, np.array([3.0, 1.0, 0.0]))
    places = framed(cloud, camera, pose)
    assert 0 < len(places) < 0.5 * len(cloud)
    whole, part = (
        NativeRenderer().render([PosedSplats(c, Pose.identity())], camera, pose).rgb
        for c in (cloud, cloud.select(places))
    )
    assert whole.max() > 0.1
    np.testing.assert_allclose(part, whole, atol=2e-3)


def test_what_lies_behind_is_not_framed():
    cloud = scattered()
    pose = Pose.identity()
    places = framed(cloud, Pinhole.from_fov(120, 90, 1.0), pose)
    behind = cloud.means[:, 2] < -1.0
    small = cloud.scales.max(axis=1) < 0.05
    assert not (behind & small)[places].any()
