"""Depth from pairs of photos, against a room of known planes."""

import numpy as np
import pytest

from scenes.cameras import pixel_centres
from scenes.pose import Pose
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.train.depth.stereo import consistent_depth, seen_depths


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


def test_partners_that_cannot_be_rectified_take_no_place(corner):
    """Views ahead, turned so that the line to them lies in the picture, are of no use for rows."""
    own = corner.views[0]
    rotation = own.world_from_camera.rotation
    ahead = []
    for k in range(4):
        # At the best angle for a partner, but so far ahead that no rows run through both.
        step = 0.5 * rotation[:, 2] + (0.46 + 0.01 * k) * rotation[:, 0]
        pose = Pose(rotation, own.world_from_camera.translation + step)
        ahead.append(View(f"ahead-{k}.png", own.image, own.camera, pose))
    alone = seen_depths(corner, longest_px=320)[0].depth
    views = (own, *ahead, *corner.views[1:])
    crowded = Reconstruction(views, corner.points, corner.colours, corner.errors_px)
    found = seen_depths(crowded, longest_px=320)[0].depth
    assert (alone > 0).mean() > 0.4
    assert (found > 0).mean() > 0.9 * (alone > 0).mean()


def test_a_view_alone_says_nothing(corner):
    alone = Reconstruction(corner.views[:1], corner.points, corner.colours, corner.errors_px)
    (found,) = seen_depths(alone, longest_px=320)
    assert not found.depth.any()


def test_depths_agree_or_are_not_known():
    depths = [np.array([[2.0, 2.0, 0.0, 5.0]]), np.array([[2.01, 3.0, 0.0, 2.0]])]
    depths.append(np.array([[9.0, 4.0, 1.0, 2.02]]))
    found = consistent_depth([depth.astype(np.float32) for depth in depths])
    np.testing.assert_allclose(found, [[2.005, 0, 0, 2.01]], rtol=1e-6)
