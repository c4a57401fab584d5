"""Splats where photos show something and nothing is drawn yet: a wall with a gap."""

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.harmonics import SH_C0
from scenes.pose import Pose
from scenes.prepare.progress import silent
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train.coverage import box_around, uncovered_splats
from scenes.prepare.train.train import BuiltInTrainer
from scenes.prepare.train.trainer import TrainingOptions
from scenes.prepare.train.training_photos import Photo
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud, concatenate

AWAY_M = 2.0
WALL = (0.8, 0.6, 0.4)
PINHOLE = Pinhole.from_fov(160, 120, np.radians(60))
FISHEYE = Fisheye(160, 160, 60.0, 80.0, 80.0, 1.0)


def wall(*, gap_m):
    """Splats on the plane z = 2 in front of a camera at the origin, but for a square gap."""
    across = np.arange(-4.0, 4.0, 0.04)
    x, y = (values.ravel() for values in np.meshgrid(across, across))
    kept = np.maximum(np.abs(x), np.abs(y)) > gap_m / 2
    means = np.column_stack([x, y, np.full(len(x), AWAY_M)])[kept]
    n = len(means)
    colours = np.tile((np.array(WALL) - 0.5) / SH_C0, (n, 1))[:, None, :]
    return SplatCloud(
        means.astype(np.float32),
        np.full((n, 3), 0.03, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, 0.9, np.float32),
        colours.astype(np.float32),
    )


def photo(camera, colour=WALL):
    size = (camera.height_px, camera.width_px, 3)
    picture = np.broadcast_to(np.round(255 * np.array(colour)), size).astype(np.uint8)
    return Photo("wall", picture, camera, Pose.identity())


def added_to(cloud, *photos):
    return uncovered_splats(
        cloud,
        photos,
        NativeRenderer(),
        RenderOptions(sh_degree=0),
        box=box_around(cloud.means),
        typical_distance=AWAY_M,
    )


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE])
def test_a_gap_is_closed_on_the_wall_around_it(camera):
    cloud = wall(gap_m=0.6)
    added = added_to(cloud, photo(camera))
    assert len(added) > 10
    assert np.abs(added.means[:, :2]).max() < 0.4
    assert np.abs(added.means[:, 2] - AWAY_M).max() < 0.1
    np.testing.assert_allclose(added.colours(), np.tile(WALL, (len(added), 1)), atol=0.01)
    posed = [PosedSplats(concatenate([cloud, added]), Pose.identity())]
    drawn = NativeRenderer().render(posed, camera, Pose.identity(), RenderOptions(sh_degree=0))
    seen = np.hypot(
        *(np.indices(drawn.alpha.shape) - np.array(drawn.alpha.shape)[:, None, None] / 2)
    )
    assert drawn.alpha[seen < 8].min() > 0.5


def test_they_lie_flat_across_the_ray():
    added = added_to(wall(gap_m=0.6), photo(PINHOLE))
    covariances = added.covariances()
    rays = added.means / np.linalg.norm(added.means, axis=1, keepdims=True)
    along = np.einsum("ni,nij,nj->n", rays, covariances, rays)
    assert (along < 0.1 * np.trace(covariances, axis1=1, axis2=2)).all()


def test_a_second_photo_of_the_same_gap_adds_nothing():
    cloud = wall(gap_m=0.6)
    once = added_to(cloud, photo(PINHOLE))
    assert len(added_to(cloud, photo(PINHOLE), photo(PINHOLE))) == len(once)


def test_a_whole_wall_needs_none_and_the_backgrounds_colour_neither():
    assert not len(added_to(wall(gap_m=0.0), photo(PINHOLE)))
    assert not len(added_to(wall(gap_m=0.6), photo(PINHOLE, colour=(0.02, 0.0, 0.03))))


def test_without_anything_drawn_they_lie_at_the_typical_distance():
    nothing = wall(gap_m=0.0).select(np.zeros(0, dtype=np.int64))
    added = added_to(nothing, photo(PINHOLE))
    np.testing.assert_allclose(added.means[:, 2], AWAY_M, rtol=1e-5)


def test_half_of_a_ball_without_points_is_trained_all_the_same(filmed_ball, tmp_path):
    shown = filmed_ball.points[:, 0] > 0.3
    half = Reconstruction(
        filmed_ball.views,
        filmed_ball.points[shown],
        filmed_ball.colours[shown],
        filmed_ball.errors_px[shown],
    )
    options = TrainingOptions(iterations=300, budget=900, stereo_px=8, exposure=False, previews=0)
    trainer = BuiltInTrainer(options, rng=lambda: np.random.default_rng(4), stopwatch=lambda: 0.0)
    trained = trainer.train(half, tmp_path, progress=silent)
    assert min(score.psnr_db for score in trained.held_out) > 15


def test_a_box_ends_where_the_room_does():
    """Rays from inside leave it where its sides are; of a place outside it says nothing."""
    rng = np.random.default_rng(2)
    box = np.array([4.0, 5.0, 2.5])
    places = rng.uniform(-0.5, 0.5, (4000, 3))
    side = rng.integers(0, 3, 4000)
    places[np.arange(4000), side] = np.sign(places[np.arange(4000), side]) * 0.5
    known = places * box
    known = known[known[:, 2] < 1.24]
    n = len(known)
    cloud = SplatCloud(
        known.astype(np.float32),
        np.full((n, 3), 0.02, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        np.full(n, 0.9, np.float32),
        np.zeros((n, 1, 3), np.float32),
    )
    around = box_around(cloud.means)
    eye = np.array([0.5, 0.3, 0.0])
    rays = rng.normal(size=(200, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    ends = eye + around.exits(eye, rays)[:, None] * rays
    np.testing.assert_allclose(np.abs(ends / box).max(axis=1), 0.5, atol=0.03)
    assert np.isnan(around.exits(np.array([9.0, 0.0, 0.0]), rays)).all()


def test_a_box_is_turned_with_its_room():
    rng = np.random.default_rng(3)
    flat = rng.uniform(-0.5, 0.5, (3000, 3)) * np.array([6.0, 3.0, 2.5])
    turned = flat @ Pose.from_yaw(0.4).rotation.T
    around = box_around(turned)
    sides = np.sort((around.high - around.low)[:2])
    np.testing.assert_allclose(sides, [3.0, 6.0], atol=0.15)
