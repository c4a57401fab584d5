"""A resting view equals a picture drawn anew, to the pixel, whatever changes in between."""

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from studio.view import resting as module
from studio.view.resting import RestingView
from studio.view.twin import Twin

CAMERA = Pinhole.from_fov(130, 98, 1.1)
STEP_M = np.array([0.03, 0.01, 0.0])
EYE = look_at(np.array([0.4, -1.6, 1.4]), np.array([0.0, 0.0, 0.4]))


@pytest.fixture
def renderer():
    return NativeRenderer()


@pytest.fixture
def twin(tiny, renderer):
    return Twin(tiny.scene, renderer)


def assert_same(twin, view, poses, camera=CAMERA, eye=EYE, **options):
    drawn = twin.drawn(poses, camera, eye, resting=view, **options)
    wanted = twin.drawn(poses, camera, eye, **options)
    np.testing.assert_array_equal(drawn.picture, wanted.picture)
    np.testing.assert_array_equal(drawn.depth, wanted.depth)
    return drawn.picture


def moved(tiny, k):
    first = tiny.scene.objects[0]
    pose = first.world_from_object
    return {first.object_id: Pose(pose.rotation, pose.translation + k * STEP_M)}


def test_every_picture_of_a_moving_object_is_that_of_a_view_drawn_anew(tiny, twin, renderer):
    view = RestingView(renderer)
    seen = [assert_same(twin, view, moved(tiny, k), opens=True) for k in (0, 1, 2, 2, 7, -9)]
    assert (seen[1] != seen[4]).any()


def test_another_eye_camera_room_or_object_list_changes_all(tiny, twin, renderer):
    view = RestingView(renderer)
    twin.make_coarse()
    outside = look_at(np.array([9.0, -9.0, 5.0]), np.zeros(3))
    other = Pinhole.from_fov(64, 64, 1.0)
    for _ in range(3):
        assert_same(twin, view, {}, coarse=True)
    for eye, camera in ((EYE, CAMERA), (outside, CAMERA), (EYE, other), (EYE, other)):
        for k in (0, 1, 2):
            assert_same(twin, view, moved(tiny, k), camera=camera, eye=eye, opens=True)
    for twins in ((), tuple(twin_items(tiny)), ()):
        assert_same(twin, view, {}, things=twins)


def twin_items(tiny):
    from scenes.render.renderer import PosedSplats

    yield PosedSplats(tiny.scene.objects[0].splats, Pose(np.eye(3), np.array([0.3, 0.2, 0.5])))


def test_a_picture_behind_the_room_is_drawn_anew(twin, renderer):
    lens = Fisheye.from_fov(64, 3.2)
    view = RestingView(renderer)
    for _ in range(3):
        assert_same(twin, view, {}, camera=lens)


def test_the_picture_is_the_caller_s_and_only_moved_tiles_are_made_bytes(
    tiny, twin, renderer, monkeypatch
):
    view = RestingView(renderer)
    for k in (0, 1, 2):
        assert_same(twin, view, moved(tiny, k)).fill(0)
    pixels = []
    convert = module.in_bytes
    monkeypatch.setattr(
        module, "in_bytes", lambda rgb: pixels.append(rgb[..., 0].size) or convert(rgb)
    )
    twin.drawn(moved(tiny, 2), CAMERA, EYE, resting=view)
    assert pixels == []
    twin.drawn(moved(tiny, 3), CAMERA, EYE, resting=view)
    assert 0 < sum(pixels) < CAMERA.width_px * CAMERA.height_px
