"""Views cropped to one thing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.votes.cropped_views import MAX_PX, close_views, cropped, evenly

SIZE = np.array([0.3, 0.2, 0.4])
CENTRE = np.array([0.0, 0.0, 0.2])
CAMERA = Pinhole(1280, 960, 900.0, 900.0, 640.0, 480.0)


def test_only_views_that_frame_the_thing_are_kept_in_their_order():
    points = CENTRE + np.random.default_rng(2).uniform(-0.5, 0.5, (200, 3)) * SIZE
    targets = [CENTRE, CENTRE + np.array([9.0, 0, 0]), CENTRE, CENTRE]
    eyes = [np.array([0.2 * k, -1.5, 0.8]) for k in range(4)]
    views = [
        ViewPoint(f"{k}", CAMERA, look_at(eye, target))
        for k, (eye, target) in enumerate(zip(eyes, targets, strict=True))
    ]
    close = close_views(views, points)
    assert [view.name for view in close] == ["0", "2", "3"]
    assert [view.zoom for view in close] == pytest.approx([v.camera.fx / 900.0 for v in close])
    assert all(0 < view.zoom <= 1 for view in close)
    assert [view.name for view in evenly(close, 2)] == ["0", "3"]
    assert evenly(close, 9) == close
    assert close_views(views, points[:0]) == ()


@settings(max_examples=20, deadline=None)
@given(turn=st.floats(0, 6.28), far=st.floats(1.0, 6.0), high=st.floats(-0.5, 1.5))
def test_a_crop_sees_the_same_points_larger_or_smaller(turn, far, high):
    eye = np.array([far * np.cos(turn), far * np.sin(turn), 0.2 + high])
    world_from_camera = look_at(eye, CENTRE)
    points = CENTRE + np.random.default_rng(1).uniform(-0.5, 0.5, (200, 3)) * SIZE
    camera = Pinhole(1280, 960, 900.0, 900.0, 640.0, 480.0)
    crop = cropped(camera, world_from_camera, points)
    assert crop is not None
    assert max(crop.width_px, crop.height_px) <= MAX_PX
    in_camera = world_from_camera.inverse() @ points
    pixels, valid = crop.project(in_camera)
    assert valid.all()
    whole, _ = camera.project(in_camera)
    scale = crop.fx / camera.fx
    np.testing.assert_allclose(np.diff(pixels, axis=0), scale * np.diff(whole, axis=0), atol=1e-6)
    assert cropped(camera, world_from_camera, points + world_from_camera.rotation[:, 0] * 9) is None
