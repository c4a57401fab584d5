"""The origin from pictures of a headset, on a thread of its own."""

import math
import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from devices.clock import WallClock
from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.align.codes.symbols import qr_symbol
from studio.live.hololens.anchoring import Anchoring
from studio.live.hololens.timing import Durations
from tracking.headset.corner_fit import code_corners
from tracking.headset.origin import OriginPlan

CAMERA = Pinhole.from_fov(760, 428, math.radians(64.7))
DEVICE_FROM_WORLD = Pose.from_yaw(0.8, (1.0, -2.0, -1.6))


def picture_of(code, world_from_camera, *, number):
    """A grey wall with a code on it, as a headset takes it."""
    symbol = qr_symbol(code.payload)
    printed = symbol.picture(module_px=16)
    quiet, side = 16 * symbol.quiet_modules, 16 * symbol.modules
    square = np.float32([[0, 0], [side, 0], [side, side], [0, side]]) + quiet
    corners = (world_from_camera.inverse() @ code.world_from_code) @ code_corners(code.side_m)
    pixels, is_in = CAMERA.project(corners)
    assert is_in.all()
    fine = 4
    turn = cv2.getPerspectiveTransform(square - 0.5, np.float32(pixels) * fine - 0.5)
    ground = np.full((428 * fine, 760 * fine), 120, np.uint8)
    size, mode = ground.shape[::-1], cv2.BORDER_TRANSPARENT
    drawn = cv2.warpPerspective(printed, turn, size, ground, cv2.INTER_AREA, borderMode=mode)
    grey = cv2.GaussianBlur(
        cv2.resize(drawn, (760, 428), interpolation=cv2.INTER_AREA), (0, 0), 0.6
    )
    pose = DEVICE_FROM_WORLD @ world_from_camera
    t_ns = number * 150_000_000
    return SimpleNamespace(
        seq=number,
        t_ns=t_ns,
        camera=CAMERA,
        world_from_camera=pose,
        picture=SimpleNamespace(y=grey),
    )


@pytest.fixture
def anchoring(scanned_package, headset):
    noted = []
    made = Anchoring(
        headset.videos,
        OriginPlan(scanned_package.codes),
        clock=WallClock(),
        note=lambda kind, text: noted.append(kind),
        delays=Durations(),
    )
    made.noted = noted
    return made


def test_a_code_gives_the_origin_and_says_so(anchoring, scanned_package):
    assert anchoring.device_from_world() is None
    assert not anchoring.status().is_known
    (code,) = scanned_package.codes
    for number in range(12):
        eye = np.array([-0.2, 0.5 - 0.08 * number, 1.6])
        view = look_at(eye, code.world_from_code.translation)
        anchoring.look(picture_of(code, view, number=number))
    status = anchoring.status()
    assert status.is_known
    assert status.codes == ("room:1",)
    assert anchoring.noted == ["headset-anchored"]
    off = anchoring.device_from_world().inverse() @ DEVICE_FROM_WORLD
    assert np.linalg.norm(off.translation) < 0.03
    assert anchoring.has_codes
    assert 1.0 < status.sigma_mm < 60.0


def test_pictures_are_taken_as_they_come(anchoring, scanned_package, headset):
    (code,) = scanned_package.codes
    view = look_at(np.array([-0.2, 0.3, 1.6]), code.world_from_code.translation)
    headset.videos.waiting.append(picture_of(code, view, number=0))
    anchoring.start()
    deadline = time.monotonic() + 120
    while anchoring.device_from_world() is None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    anchoring.close()
    assert anchoring.picture.seq == 0
    assert headset.videos.is_closed


def test_a_lost_headset_says_nothing(anchoring, scanned_package):
    (code,) = scanned_package.codes
    view = look_at(np.array([-0.2, 0.3, 1.6]), code.world_from_code.translation)
    lost = picture_of(code, view, number=0)
    lost.world_from_camera = None
    anchoring.look(lost)
    assert not anchoring.status().is_known
