"""`sim.reality.look` and `sim.reality.room`: a scan as the simulated camera sees it."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.prepare.cutout.likewise import TakenApart
from scenes.render.native import NativeRenderer
from sim.bodies import Placement, body_of_object
from sim.camera.camera360 import Camera360, default_rig
from sim.reality.look import SplatLook
from sim.reality.room import scanned_room


@pytest.fixture(scope="module")
def room(scan):
    parts = TakenApart(scan.room, {"box": scan.box}, {})
    return scanned_room(scan.scene, parts, NativeRenderer())


@pytest.fixture(scope="module")
def camera(room):
    look = SplatLook(room, renderer=NativeRenderer())
    bodies = [body_of_object(item) for item in room.objects]
    made = Camera360(room, default_rig(256), room.world_from_rig, bodies, look=look)
    yield made
    made.close()


def seen(camera, pose):
    return camera.view({"box": Placement((pose,), 0.0)})


def test_a_scanned_room_is_made_of_splats_and_a_mesh(room, scan):
    assert room.static == ()
    assert room.solids == ()
    assert room.collision is scan.scene.collision
    assert room.objects[0].splats is scan.box
    assert np.linalg.norm(room.light_direction) == pytest.approx(1.0)


def test_a_scan_without_a_mesh_is_refused(scan):
    parts = TakenApart(scan.room, {}, {})
    with pytest.raises(ValueError, match="no collision mesh"):
        scanned_room(replace(scan.scene, collision=None), parts, NativeRenderer())


def test_the_box_is_seen_red_where_it_stands(camera, scan):
    view = seen(camera, scan.scene.objects[0].world_from_object)
    ids, rgb = view.lenses[0].ids, view.lenses[0].rgb
    assert (ids == 1).sum() > 100
    red = rgb[ids == 1].astype(float).mean(axis=0)
    assert red[0] > 2.0 * red[1]
    assert view.visible_fraction["box"] > 0.9


def test_a_box_behind_the_camera_is_seen_by_the_other_lens_only(camera):
    view = seen(camera, Pose.from_yaw(0.0, (0.0, -1.3, 0.0)))
    assert (view.lenses[0].ids == 1).sum() < (view.lenses[1].ids == 1).sum()


def test_the_box_casts_a_shadow_on_the_scanned_floor(room, scan):
    bright = replace(room.splats, sh=np.zeros_like(room.splats.sh))
    room = replace(room, splats=bright)
    look = SplatLook(room, renderer=NativeRenderer())
    bodies = [body_of_object(item) for item in room.objects]
    camera = Camera360(room, default_rig(256), room.world_from_rig, bodies, look=look)
    empty = camera.view({}).lenses[0].rgb.astype(int)
    with_box = seen(camera, scan.scene.objects[0].world_from_object).lenses[0]
    camera.close()
    darker = (with_box.rgb.astype(int) - empty).sum(axis=2)[with_box.ids == 0]
    assert (darker < -30).sum() > 20


def test_a_room_of_meshes_needs_no_look(room):
    with pytest.raises(ValueError, match="made of meshes"):
        SplatLook(replace(room, splats=None), renderer=NativeRenderer())
