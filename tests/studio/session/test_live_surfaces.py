from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from scenes.quad import quad_of
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from studio.session.live_surfaces import LiveSurfaces, clicked_surface, live_surface
from tracking.background.images import render_background
from tracking.output import TrackOutput

BOARD = np.array([[-0.9, 1.5, 1.2], [0.9, 1.5, 1.2], [0.9, 1.5, 0.3], [-0.9, 1.5, 0.3]])


LENS = Fisheye.from_fov(360, np.radians(200))


def first(tiny):
    """A frame of the room as it was scanned, large enough to see a board in."""
    frame = next(iter(tiny.inputs())).frame
    rig = Rig((LENS, LENS), frame.rig.rig_from_lens)
    background = render_background(NativeRenderer(), tiny.scene.room, rig, frame.world_from_rig)
    images = tuple(
        (255 * np.clip(image.whole(), 0, 1)).astype(np.uint8) for image in background.images
    )
    return replace(frame, images=images, rig=rig)


def level_floor():
    x, y = np.meshgrid(np.arange(-1.5, 1.5, 0.05), np.arange(-1.5, 1.5, 0.05))
    means = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(np.float32)
    count = len(means)
    return SplatCloud(
        means,
        np.tile(np.array([0.04, 0.04, 0.002], np.float32), (count, 1)),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.98, np.float32),
        np.zeros((count, 1, 3), np.float32),
    )


def step(tiny, frame, world_from_chair, live):
    answer = tiny.tracker(0.0).step(0, frame, 0)[1]
    moved = tuple(
        replace(t, world_from_object=world_from_chair) if t.object_id == "chair-1" else t
        for t in answer.objects
    )
    surface = live_surface("board", BOARD, frame)
    return live.step(frame, {"board": surface}, TrackOutput(moved))[0]


def test_an_object_before_a_surface_keeps_what_was_there(tiny):
    frame = first(tiny)
    aside = Pose.from_yaw(0.0, (1.8, -1.5, 0.0))
    before = Pose.from_yaw(0.0, (0.0, 0.2, 0.3))
    changed = replace(frame, images=tuple(np.minimum(image, 250) + 3 for image in frame.images))
    free, hidden = LiveSurfaces(tiny.scene), LiveSurfaces(tiny.scene)
    step(tiny, frame, aside, free)
    old = step(tiny, frame, aside, hidden).picture
    seen, kept = step(tiny, changed, aside, free), step(tiny, changed, before, hidden)
    renewed = (seen.picture != old).any(axis=2).mean()
    assert renewed > 0.7
    assert 0.1 < (kept.picture != old).any(axis=2).mean() < renewed - 0.02


def test_a_surface_is_as_fine_as_the_camera_sees_it(tiny):
    frame = first(tiny)
    surface = live_surface("board", BOARD, frame)
    assert surface.size_px[0] > surface.size_px[1] >= 16
    assert surface.stream_id == frame.stream_id


def test_without_a_camera_pose_it_is_told(tiny):
    frame = replace(first(tiny), world_from_rig=None)
    with pytest.raises(ValueError, match="pose of camera 'camera-360' is not known"):
        live_surface("board", BOARD, frame)
    with pytest.raises(ValueError, match="pose of camera 'camera-360' is not known"):
        clicked_surface("board", np.zeros((4, 2)), frame, None, tiny.scene.room)


def test_clicks_on_the_floor_become_a_level_surface(tiny):
    frame = first(tiny)
    corners = np.array([[-0.6, 0.9, 0.0], [0.6, 0.9, 0.0], [0.5, -0.2, 0.0], [-0.5, -0.2, 0.0]])
    world_from_lens = frame.world_from_rig @ frame.rig.rig_from_lens[0]
    clicks, _ = frame.rig.lenses[0].project(world_from_lens.inverse() @ corners)
    floor = level_floor()
    surface = clicked_surface("floor", clicks, frame, None, floor)
    np.testing.assert_allclose(surface.corners_in_world, corners, atol=0.05)
    assert quad_of(surface.corners_in_world).faces(frame.world_from_rig.translation)
