from __future__ import annotations

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye, Rig, pixel_centres
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.footage.panorama_views import panorama_views, view_pictures

LENS = Fisheye.from_fov(240, math.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))


def directions_as_colours(rays: np.ndarray) -> np.ndarray:
    return (rays * 100 + 128).astype(np.uint8)


def test_the_views_close_a_ring_and_show_what_lies_there():
    views = panorama_views(RIG)
    assert len(views) == 6
    lens_rays = LENS.unproject(pixel_centres(LENS))
    halves = [
        directions_as_colours(lens_rays @ rig_from_lens.rotation.T).reshape(240, 240, 3)
        for rig_from_lens in RIG.rig_from_lens
    ]
    pictures = view_pictures(np.hstack(halves), RIG, views)
    seen = []
    for view, picture in zip(views, pictures, strict=True):
        rig_from_view = RIG.rig_from_lens[view.lens] @ view.lens_from_view
        rays = view.camera.unproject(pixel_centres(view.camera)) @ rig_from_view.rotation.T
        inside = view.table.valid.ravel()
        off = directions_as_colours(rays).astype(int) - picture.reshape(-1, 3)
        assert np.quantile(np.abs(off[inside]), 0.99) <= 4
        assert inside.mean() > 0.9
        level = np.abs(rays[:, 1]) < 0.1
        seen.append(np.degrees(np.arctan2(rays[inside & level, 0], rays[inside & level, 2])))
    assert set(np.arange(-180, 180, 5)) == set((np.concatenate(seen) // 5 * 5).astype(int))


def test_a_picture_of_another_camera_is_refused():
    with pytest.raises(CaptureError, match=r"640×240 px, but .* 480×240"):
        view_pictures(np.zeros((240, 640, 3), np.uint8), RIG, panorama_views(RIG))
