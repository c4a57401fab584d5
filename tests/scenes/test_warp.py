"""`scenes.warp` with pictures whose content is known at every direction."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye, Rig, pixel_centres
from scenes.frames import FRONT_FROM_BACK_LENS, look_at
from scenes.pose import Pose
from scenes.warp import best_lens, front_view, view_towards, warp, warp_table

LENS = Fisheye.from_fov(400, math.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))


def picture_of_directions(camera, world_from_camera):
    """(H, W, 3) float32: each pixel holds the world direction it looks along."""
    rays = camera.unproject(pixel_centres(camera)) @ world_from_camera.rotation.T
    return rays.reshape(camera.height_px, camera.width_px, 3).astype(np.float32)


def rig_pictures(world_from_rig):
    return [picture_of_directions(LENS, world_from_rig @ pose) for pose in RIG.rig_from_lens]


@pytest.mark.parametrize(
    "target", [(3.0, 1.0, 0.5), (-2.0, -2.0, 0.2), (0.3, 2.0, 2.4), (0.0, -3.0, 1.0)]
)
def test_a_view_towards_a_point_shows_what_lies_there(target):
    world_from_rig = look_at(np.array([0.2, -0.1, 1.3]), np.array([1.0, 2.0, 1.3]))
    view = view_towards(RIG, world_from_rig, target, size_px=(64, 48))
    seen = warp(rig_pictures(world_from_rig)[view.lens], view.table)
    assert view.table.valid.all()
    wanted = picture_of_directions(view.camera, view.world_from_camera)
    # Half a pixel off would be 1/2/115 rad.
    assert np.abs(seen - wanted).max() < 5e-4
    towards = np.asarray(target) - world_from_rig.translation
    pixel, valid = view.camera.project(view.world_from_camera.inverse() @ np.asarray([target]))
    assert valid[0]
    np.testing.assert_allclose(pixel[0], [32, 24], atol=1e-9)
    np.testing.assert_allclose(
        seen[23:25, 31:33].mean(axis=(0, 1)), towards / np.linalg.norm(towards), atol=1e-3
    )


def test_the_lens_that_looks_there_is_taken():
    world_from_rig = look_at(np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 1.0]))
    assert best_lens(RIG, world_from_rig, (0.5, 2.0, 0.0)) == 0
    assert best_lens(RIG, world_from_rig, (0.5, -2.0, 0.0)) == 1
    assert view_towards(RIG, world_from_rig, (0.5, 2.0, 0.0), size_px=(8, 8), lens=1).lens == 1


def test_native_resolution_is_the_default():
    view = view_towards(RIG, Pose.identity(), (0, 0, 2.0), size_px=(32, 32))
    assert view.camera.fx == LENS.f_px


def test_front_view_looks_along_the_front_lens():
    world_from_rig = Pose.from_yaw(0.4, (1, 2, 3))
    view = front_view(RIG, world_from_rig, size_px=64, fov=math.radians(120))
    seen = warp(rig_pictures(world_from_rig)[0], view.table)
    assert np.abs(seen - picture_of_directions(view.camera, view.world_from_camera)).max() < 2e-3


def test_directions_outside_the_lens_are_marked_and_black():
    narrow = Fisheye.from_fov(200, math.radians(90))
    table = warp_table(
        narrow,
        view_towards(RIG, Pose.identity(), (0, 0, 1), size_px=(200, 200), focal_px=60.0).camera,
        Pose.identity(),
    )
    assert table.valid[100, 100]
    assert not table.valid[0, 0]
    white = np.full((200, 200), 255, np.uint8)
    assert warp(white, table)[0, 0] == 0
