"""What views say about places: in front, on, a little off, hidden."""

from pathlib import Path

import numpy as np
import pytest

from scenes.cameras import Pinhole, pixel_centres
from scenes.pose import Pose
from scenes.prepare.reconstruction import View
from scenes.prepare.train.depth.seen_surfaces import (
    FILLED_SLACK,
    REACH,
    SEEN_SLACK,
    Surface,
    filled,
    judge,
    surfaces_of,
)
from scenes.prepare.train.depth.stereo import SeenDepth

CAMERA = Pinhole.from_fov(80, 60, 1.2)


def wall(x, is_seen=True):
    """What a camera at (x, 0, 0) that looks along z sees of a wall at z = 2."""
    shape = (CAMERA.height_px, CAMERA.width_px)
    return Surface(
        f"at {x}",
        CAMERA,
        Pose.from_quaternion((1, 0, 0, 0), (x, 0.0, 0.0)),
        np.zeros((*shape, 3), np.uint8),
        np.full(shape, 2.0, np.float32),
        np.full(shape, is_seen),
        np.zeros(shape, np.bool_),
    )


WALLS = [wall(x) for x in (-0.2, 0.0, 0.2)]


def test_what_views_see_through_is_stray():
    points = np.array([[0.0, 0, 1.0], [0.1, 0.1, 1.5], [0, 0, 2.0], [0, 0, 3.0], [0, 0, -1.0]])
    verdict = judge(points, WALLS)
    np.testing.assert_array_equal(verdict.is_stray, [True, True, False, False, False])
    np.testing.assert_array_equal(verdict.offset, 0)


@pytest.mark.parametrize("share", [-0.8, 0.8])
def test_what_is_a_little_off_a_surface_is_put_on_it(share):
    points = np.array([[0.05, 0.1, 2 + 2 * share * REACH]])
    verdict = judge(points, WALLS)
    assert not verdict.is_stray.any()
    assert (points + verdict.offset)[0, 2] == pytest.approx(2.0, abs=1e-6)


def test_what_is_on_a_surface_stays():
    points = np.array([[0.05, 0.1, 2 - 1.8 * SEEN_SLACK]])
    verdict = judge(points, WALLS)
    assert not verdict.is_stray.any()
    np.testing.assert_array_equal(verdict.offset, 0)


def test_filled_depth_is_held_to_less():
    points = np.array([[0.0, 0, 2 - 1.6 * FILLED_SLACK], [0, 0, 1.0]])
    seen = judge(points, WALLS)
    assert (seen.is_stray | seen.offset.any(axis=1)).tolist() == [True, True]
    guessed = [wall(x, is_seen=False) for x in (-0.2, 0.0, 0.2)]
    assert judge(points, guessed).is_stray.tolist() == [False, True]


def test_one_view_is_not_enough_and_none_says_nothing():
    points = np.array([[0.0, 0, 1.0]])
    assert not judge(points, WALLS[:1]).is_stray.any()
    assert not judge(points, []).is_stray.any()


def test_a_plane_goes_on_between_what_is_seen():
    rays = CAMERA.unproject(pixel_centres(CAMERA))
    normal = np.array([0.3, -0.2, 1.0])
    depth = (2.0 / (rays @ normal) * rays[:, 2]).reshape(CAMERA.height_px, CAMERA.width_px)
    holes = depth.copy()
    holes[16:44, 20:60] = 0
    picture = np.full((*depth.shape, 3), 90, np.uint8)
    whole = filled(holes.astype(np.float32), picture)
    np.testing.assert_allclose(whole[holes > 0], depth[holes > 0], rtol=1e-6)
    np.testing.assert_allclose(whole, depth, rtol=0.03)


def seen_by(x, depth):
    shown = wall(x)
    view = View(f"{x}", Path(), CAMERA, shown.world_from_camera)
    return SeenDepth(view, CAMERA, shown.picture, depth)


def test_depth_that_other_views_contradict_is_not_believed():
    right, wrong = np.full((60, 80), 2.0, np.float32), np.full((60, 80), 1.5, np.float32)
    surfaces = surfaces_of([seen_by(x, right) for x in (-0.2, 0.0, 0.2)] + [seen_by(0.1, wrong)])
    for surface in surfaces[:3]:
        assert surface.is_seen.mean() > 0.6
    assert not surfaces[3].is_seen.any()
    assert surfaces[3].is_propagated.mean() > 0.8
    for surface in surfaces:
        np.testing.assert_allclose(surface.depth, 2.0, rtol=1e-3)


def test_depth_that_views_nearly_agree_about_becomes_their_mean():
    depths = [np.full((60, 80), z, np.float32) for z in (1.99, 2.0, 2.01)]
    middle = surfaces_of([seen_by(x, d) for x, d in zip((-0.02, 0, 0.02), depths, strict=True)])[1]
    np.testing.assert_allclose(middle.depth[10:50, 10:70], 2.0, atol=2e-3)
