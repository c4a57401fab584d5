"""Crops of photos: where a region is seen, and in the room's own colours."""

import cv2
import numpy as np
import pytest

from scenes.pose import Pose
from scenes.prepare.reconstruction import View
from scenes.prepare.refine.crops import MAX_CROP_PX, crops_of
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions


def crops(room, is_region, views):
    return crops_of(
        room, is_region, views=views, renderer=NativeRenderer(), options=RenderOptions()
    )


def test_a_crop_is_the_part_of_the_photo_that_shows_the_region(coarse_ball, is_upper, ball_views):
    found = crops(coarse_ball, is_upper, ball_views)
    assert len(found) == 16
    assert [c.shown_px for c in found] == sorted((c.shown_px for c in found), reverse=True)
    top = coarse_ball.means[coarse_ball.means[:, 2].argmax()].astype(float)
    for crop in found:
        assert crop.picture.shape == (crop.camera.height_px, crop.camera.width_px, 3)
        assert max(crop.picture.shape) <= MAX_CROP_PX
        (pixel,), _ = crop.camera.project(crop.world_from_camera.inverse() @ top[None])
        column, row = pixel.astype(int)
        if 0 <= row < len(crop.near) and 0 <= column < crop.near.shape[1]:
            assert crop.near[row, column]


def test_away_from_the_region_the_room_is_shown_as_it_is_drawn(coarse_ball, ball_views):
    cap = coarse_ball.means[:, 2] > 0.8
    crop = crops(coarse_ball, cap, ball_views)[0]
    drawn = NativeRenderer().render(
        [PosedSplats(coarse_ball, Pose.identity())],
        crop.camera,
        crop.world_from_camera,
        RenderOptions(),
    )
    wanted = np.round(255 * np.clip(drawn.rgb, 0, 1))
    np.testing.assert_array_equal(crop.picture[~crop.near], wanted[~crop.near])
    np.testing.assert_array_equal(crop.picture[crop.near], crop.photo[crop.near])


def test_a_photos_exposure_is_taken_out(coarse_ball, is_upper, ball_views, tmp_path):
    views, bright = ball_views[:1], tmp_path / "bright.png"
    photo = cv2.imread(str(views[0].image)).astype(float)
    cv2.imwrite(str(bright), np.clip(1.15 * photo + 6, 0, 255).astype(np.uint8))
    lit = View("bright", bright, views[0].camera, views[0].world_from_camera)
    plain = crops(coarse_ball, is_upper, views)[0]
    found = crops(coarse_ball, is_upper, [lit])[0]
    off = np.abs(found.photo.astype(int) - plain.photo)[found.near]
    assert np.median(off) <= 3


def test_photos_that_look_away_are_left_out(coarse_ball, is_upper, ball_views):
    view = ball_views[0]
    back = Pose(view.world_from_camera.rotation, view.world_from_camera.translation * -1.0)
    away = View("away", view.image, view.camera, back)
    assert crops(coarse_ball, is_upper, [away]) == []


def test_a_missing_photo_is_named(coarse_ball, is_upper, ball_views, tmp_path):
    view = ball_views[0]
    gone = View("gone", tmp_path / "gone.png", view.camera, view.world_from_camera)
    with pytest.raises(ValueError, match=r"gone\.png: not a picture"):
        crops(coarse_ball, is_upper, [gone])
