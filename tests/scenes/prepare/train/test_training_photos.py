"""Which photos are trained on, and at which size."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.prepare.train.training_photos import Photos, read_photo, smaller, typical_distance


def test_every_eighth_is_kept_aside(filmed_ball):
    photos = Photos(filmed_ball, held_out_every=8, longest_px=640)
    assert [view.name for view in photos.held_out] == ["07.png", "15.png"]
    assert len(photos.training) == 14
    assert Photos(filmed_ball, held_out_every=0, longest_px=640).held_out == ()


@pytest.mark.parametrize(
    ("longest_px", "shrink", "size"),
    [(640, 1, (96, 72)), (48, 1, (48, 36)), (48, 2, (24, 18)), (80, 1, (80, 60))],
)
def test_photos_come_at_the_size_asked_for(filmed_ball, longest_px, shrink, size):
    photo = read_photo(filmed_ball.views[0], longest_px, shrink)
    assert photo.picture.shape == (size[1], size[0], 3)
    assert (photo.camera.width_px, photo.camera.height_px) == size
    full = read_photo(filmed_ball.views[0], 640)
    np.testing.assert_allclose(photo.colours.mean(), full.colours.mean(), atol=5e-3)


@pytest.mark.parametrize("shrink", [1, 2, 4, 5])
@pytest.mark.parametrize(
    "camera", [Pinhole(97, 71, 80.0, 82.0, 40.0, 33.0), Fisheye(97, 97, 40.0, 50.0, 48.0, 1.4)]
)
def test_a_smaller_camera_sees_the_same_place_at_the_same_share(camera, shrink):
    points = np.array([[0.1, 0.2, 1.0], [-0.3, 0.1, 1.2]])
    before, _ = camera.project(points)
    after, _ = smaller(camera, shrink).project(points)
    size = np.array([camera.width_px, camera.height_px])
    small = smaller(camera, shrink)
    new_size = np.array([small.width_px, small.height_px])
    np.testing.assert_allclose(after / new_size, before / size, atol=2e-2 if shrink > 1 else 0)


def test_memory_is_bounded_and_photos_come_back(filmed_ball):
    one = read_photo(filmed_ball.views[0], 640).target().nbytes
    photos = Photos(filmed_ball, held_out_every=8, longest_px=640, kept_bytes=3 * one)
    first = photos.target(photos.training[0], 1)
    assert photos.target(photos.training[0], 1) is first
    for view in photos.training:
        photos.target(view, 1)
    assert photos.kept <= 3 * one
    assert photos.target(photos.training[0], 1) is not first


def test_the_typical_distance_is_that_of_the_points(filmed_ball):
    # Cameras 3 m away from a ball of 1 m.
    assert 2 < typical_distance(filmed_ball) < 4
    larger = replace(filmed_ball, points=10 * filmed_ball.points)
    with pytest.raises(ValueError, match="not of one world"):
        typical_distance(replace(larger, points=np.add(larger.points, [0, 0, 1e5])))
