"""Depth from pairs of photos, against a room of known planes."""

import numpy as np
import pytest

from scenes.cameras import pixel_centres
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.train.stereo import consistent_depth, seen_depths


@pytest.fixture(scope="module")
def corner(photographed):
    """The photographed corner with some points on its walls and floor."""
    rng = np.random.default_rng(0)
    at = rng.uniform(0, [4, 4, 2.5], (600, 3))
    at[np.arange(600), np.arange(600) % 3] = np.array([0.0, 4.0, 0.0])[np.arange(600) % 3]
    views = tuple(
        View(name, photographed.folder / name, photographed.camera, pose)
        for name, pose in photographed.world_from_camera.items()
    )
    return Reconstruction(views, at, np.full((600, 3), 128, np.uint8), np.zeros(600, np.float32))


def test_depth_is_that_of_the_planes(corner):
    found = seen_depths(corner, longest_px=320)
    assert [seen.view.name for seen in found] == [view.name for view in corner.views]
    off, shares = [], []
    for seen in found:
        pose = seen.view.world_from_camera
        rays = seen.camera.unproject(pixel_centres(seen.camera))
        rays /= rays[:, 2:]
        known = seen.depth.ravel() > 0
        places = pose @ (rays[known] * seen.depth.ravel()[known, None])
        walls = np.stack([places[:, 0], 4 - places[:, 1], places[:, 2]])
        # The crate is left out of what is compared.
        is_wall = np.abs(walls).min(axis=0) < 0.3
        off.append(np.abs(walls).min(axis=0)[is_wall])
        shares.append(known.mean())
    assert np.mean(shares) > 0.5
    assert np.median(np.concatenate(off)) < 0.02
    assert np.quantile(np.concatenate(off), 0.9) < 0.08


def test_a_view_alone_says_nothing(corner):
    alone = Reconstruction(corner.views[:1], corner.points, corner.colours, corner.errors_px)
    (found,) = seen_depths(alone, longest_px=320)
    assert not found.depth.any()


def test_depths_agree_or_are_not_known():
    depths = [np.array([[2.0, 2.0, 0.0, 5.0]]), np.array([[2.01, 3.0, 0.0, 2.0]])]
    depths.append(np.array([[9.0, 4.0, 1.0, 2.02]]))
    found = consistent_depth([depth.astype(np.float32) for depth in depths])
    np.testing.assert_allclose(found, [[2.005, 0, 0, 2.01]], rtol=1e-6)
