"""Pictures drawn beside: what is seen, where, and the time in them."""

from __future__ import annotations

from dataclasses import replace

import av
import cv2
import numpy as np
import pytest

from devices.hololens.camera.stream import video_request
from scenes.cameras import Pinhole
from scenes.frames import CAMERA_FROM_BOARD, look_at
from scenes.pose import Pose
from scenes.quad import QrCode
from sim.hololens.drawing.drawer import Drawer, DrawingError
from sim.hololens.drawing.scenery import CAMERA, Scenery, Shot
from sim.hololens.drawing.time_code import burn, burnt_us

CAMERA_MODEL = Pinhole.from_fov(640, 480, 1.0)
WALL_M, X = np.array([-1.97, 0.0, 1.5]), np.array([-1.0, 0.0, 0.0])
TURN = CAMERA_FROM_BOARD.rotation @ np.diag([-1.0, 1.0, -1.0])


@pytest.fixture
def drawer(small_room):
    scenery = Scenery(small_room)
    drawing = Drawer(scenery.drawn)
    yield scenery, drawing
    drawing.close()


def test_the_code_on_the_camera_is_read_where_it_is(drawer):
    scenery, drawing = drawer
    for shift in (0.0, 0.2):
        rig = scenery.room.world_from_rig
        moved = type(rig)(rig.rotation, rig.translation + np.array([shift, 0.0, 0.0]))
        scenery.move({CAMERA: moved, "nobody": moved})
        code = scenery.code_on_camera
        assert code is not None
        centre, out = code.world_from_code.translation, code.world_from_code.rotation[:, 2]
        pose = look_at(centre + 0.5 * out, centre)
        drawing.order(Shot(CAMERA_MODEL, pose, scenery.poses()))
        text, corners, _ = cv2.QRCodeDetector().detectAndDecode(
            cv2.cvtColor(drawing.picture(), cv2.COLOR_RGB2GRAY)
        )
        assert text == code.payload
        half = code.side_m / 2
        printed = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
        seen, _ = CAMERA_MODEL.project(pose.inverse() @ (code.world_from_code @ printed))
        assert np.abs(corners[0] + 0.5 - seen).max() < 2.5


def test_objects_are_drawn_where_they_are(drawer):
    scenery, drawing = drawer
    item = scenery.room.objects[0]
    place = item.world_from_object.translation
    pose = look_at(place + np.array([0.0, -1.5, 1.2]), place)
    pictures = []
    for aside in (0.0, 0.3):
        at = item.world_from_object
        poses = {item.object_id: type(at)(at.rotation, place + np.array([aside, 0.0, 0.0]))}
        scenery.move(poses)
        drawing.order(Shot(CAMERA_MODEL, pose, scenery.poses()))
        pictures.append(drawing.picture())
    assert np.abs(pictures[0].astype(int) - pictures[1]).max() > 30


def test_a_scanned_room_is_drawn_by_its_mesh_with_its_codes(scanned_small_room):
    code = QrCode("nexus:small:1", 0.3, Pose(look_at(WALL_M, WALL_M + X).rotation @ TURN, WALL_M))
    room = replace(scanned_small_room, codes=(code,))
    drawing = Drawer(Scenery(room).drawn)
    out = code.world_from_code.rotation[:, 2]
    pose = look_at(WALL_M + 1.2 * out, WALL_M)
    drawing.order(Shot(CAMERA_MODEL, pose, Scenery(room).poses()))
    grey = cv2.cvtColor(drawing.picture(), cv2.COLOR_RGB2GRAY)
    drawing.close()
    assert cv2.QRCodeDetector().detectAndDecode(grey)[0] == code.payload
    assert grey[5, 5] > 30


def test_pictures_are_coded_where_they_are_drawn_with_the_time_in_them(drawer):
    scenery, drawing = drawer
    pose = look_at(np.array([1.0, -1.0, 1.5]), np.array([0.0, 0.0, 0.5]))
    shot = Shot(CAMERA_MODEL, pose, scenery.poses(), burnt_us=123_456_789)
    drawing.order(shot)
    plain = drawing.picture()
    drawing.code(video_request(640, 480, fps=30, codec="h264"))
    drawing.order(shot)
    drawing.order(shot)
    decoder = av.CodecContext.create("h264", "r")
    units = [drawing.take(), drawing.take(), b""]
    frames = [
        frame for unit in units for frame in decoder.decode(av.Packet(unit) if unit else None)
    ]
    assert [frame.key_frame for frame in frames] == [True, False]
    for frame in frames:
        coded = frame.to_ndarray(format="gray")
        assert burnt_us(coded) == burnt_us(cv2.cvtColor(plain, cv2.COLOR_RGB2GRAY)) == 123_456_789
        assert np.abs(frame.to_ndarray(format="rgb24").astype(int) - plain).mean() < 6.0


def test_a_process_that_dies_says_why(small_room):
    drawing = Drawer(Scenery(small_room).drawn)
    nowhere = look_at(np.zeros(3), np.array([1.0, 0.0, 0.0]))
    drawing.order(Shot(CAMERA_MODEL, nowhere, {}))
    with pytest.raises(DrawingError, match="KeyError"):
        drawing.picture()
    drawing.close()


def test_time_codes_survive_a_codec_s_noise():
    rng = np.random.default_rng(0)
    for t_us in (0, 1, (1 << 48) - 1, 123_456_789_012):
        picture = np.full((240, 424, 3), 128, np.uint8)
        burn(picture, t_us)
        noisy = np.clip(picture[:, :, 0] + rng.normal(0, 12, (240, 424)), 0, 255)
        assert burnt_us(noisy.astype(np.uint8)) == t_us
    assert burnt_us(np.full((240, 424), 128, np.uint8)) is None
    assert burnt_us(np.zeros((8, 8), np.uint8)) is None
