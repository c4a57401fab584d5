"""Depth of photos by other photos, against a room of known planes."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from scenes.cameras import pixel_centres
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.train.depth.stereo import OtherPhoto, inverse_depths, seen_depths
from tests.scenes.prepare.conftest import take_photos
from tests.twins import swept_depth as twin


@pytest.fixture(scope="module")
def corner(photographed):
    """The photographed corner with some points on its walls and floor."""
    return with_points(photographed)


def with_points(photographed):
    rng = np.random.default_rng(0)
    at = rng.uniform(0, [4, 4, 2.5], (600, 3))
    at[np.arange(600), np.arange(600) % 3] = np.array([0.0, 4.0, 0.0])[np.arange(600) % 3]
    views = tuple(
        View(name, photographed.folder / name, photographed.camera, pose)
        for name, pose in photographed.world_from_camera.items()
    )
    return Reconstruction(views, at, np.full((600, 3), 128, np.uint8), np.zeros(600, np.float32))


def off_walls(found):
    """How far the places that views see are from the nearest of three walls; the crate left out."""
    off = []
    for seen in found:
        rays = seen.camera.unproject(pixel_centres(seen.camera))
        known = seen.depth.ravel() > 0
        way = (rays / rays[:, 2:])[known] * seen.depth.ravel()[known, None]
        places = seen.view.world_from_camera @ way
        nearest = np.abs([places[:, 0], 4 - places[:, 1], places[:, 2]]).min(axis=0)
        off.append(nearest[nearest < 0.3])
    return np.concatenate(off)


def test_depth_is_that_of_the_planes(corner):
    found = seen_depths(corner, longest_px=320)
    assert [seen.view.name for seen in found] == [view.name for view in corner.views]
    off = off_walls(found)
    assert np.mean([(seen.depth > 0).mean() for seen in found]) > 0.8
    assert np.median(off) < 0.015
    assert np.quantile(off, 0.9) < 0.08


def test_photos_along_the_way_forward_give_depth(raycast, tmp_path):
    """Whoever walks up to something has no photo from aside of what lies ahead."""
    start, end = np.array([3.7, 0.4, 1.6]), np.array([2.2, 1.9, 1.4])
    sway = 0.06 * np.array([1.0, 1.0, 0.0])
    eyes = [start + k / 5 * (end - start) + (-1) ** k * sway for k in range(6)]
    poses = {f"{k}.jpg": look_at(eye, np.array([1.0, 3.2, 0.9])) for k, eye in enumerate(eyes)}
    found = seen_depths(with_points(take_photos(raycast, tmp_path, poses)), longest_px=320)
    assert min((seen.depth > 0).mean() for seen in found) > 0.5
    # One in a hundred of what is 4 m away, by 320 pixels.
    assert np.median(off_walls(found)) < 0.045


def test_photos_from_the_same_place_take_nobodys_place(corner):
    """Whoever stands still while filming gives many photos that say nothing about distances."""
    own = corner.views[0]
    pose = own.world_from_camera
    still = [
        View(f"still-{k}", own.image, own.camera, Pose(pose.rotation, pose.translation + 1e-3 * k))
        for k in range(1, 10)
    ]
    alone = seen_depths(corner, longest_px=320)[0].depth
    crowded = replace(corner, views=(own, *still, *corner.views[1:]))
    found = seen_depths(crowded, longest_px=320)[0].depth
    np.testing.assert_array_equal(found, alone)


def test_the_native_sweep_is_the_readable_one():
    rng = np.random.default_rng(3)
    pattern = cv2.GaussianBlur(rng.uniform(0, 255, (26, 60)).astype(np.float32), (0, 0), 1.0)
    pattern = np.clip(128 + 3 * (pattern - 128), 0, 255).astype(np.uint8)
    # At inverse depth 2 the photos aside are shifted by two pixels to either side.
    own, left, right = (np.ascontiguousarray(pattern[:, k : k + 40]) for k in (10, 8, 12))
    turn = np.array([[1.0, 0.01, 0.2], [-0.01, 1.0, 0.1], [1e-4, -1e-4, 1.0]])
    others = [
        OtherPhoto(photo, turn, np.array([side, 0.05, 0.001]))
        for photo, side in ((left, 1.0), (right, -1.0), (right, -0.9))
    ]
    tried = (0.3, 0.37, 12)
    for used in (others, others[:2]):
        native = inverse_depths(own, used, tried=tried)
        readable = twin.inverse_depths(own, used, tried=tried)
        assert (readable > 0).mean() > 0.5
        np.testing.assert_allclose(native, readable, atol=1e-5)


def test_photos_that_cannot_be_compared_are_refused():
    grey = np.zeros((6, 8), np.uint8)
    with pytest.raises(ValueError, match="2 planes"):
        inverse_depths(grey, [], tried=(0.1, 0.1, 2))
    with pytest.raises(ValueError, match="wanted 1 to"):
        inverse_depths(np.zeros((0, 8), np.uint8), [], tried=(0.1, 0.1, 8))
    assert not inverse_depths(grey, [], tried=(0.1, 0.1, 8)).any()


def test_a_view_alone_says_nothing(corner):
    alone = Reconstruction(corner.views[:1], corner.points, corner.colours, corner.errors_px)
    (found,) = seen_depths(alone, longest_px=320)
    assert not found.depth.any()
