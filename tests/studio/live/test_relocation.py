"""A lost camera is searched for again and again, one search at a time, until the tracker has it."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.lenses.lens_pictures import assumed_rig
from devices.camera.received import Received
from devices.session_info import LiveStream
from scenes.pose import Pose
from studio.live.placing import PlacedCamera
from studio.live.relocation import SEARCH_EVERY_S, Lookout, Relocation
from tests.stream_pictures import picture_from_rgb
from tracking.output import CameraMoment, CameraNotice

LAYOUT = LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0))
LOST = (CameraNotice(CameraMoment.NOT_FOUND),)
FOUND = (CameraNotice(CameraMoment.FOUND),)
EVERY_NS = round(SEARCH_EVERY_S * 1e9)
LAST = Pose.from_yaw(0.3)


def lookout():
    picture = picture_from_rgb(np.full((64, 128, 3), 90, np.uint8))
    received = Received(7, 1, 2, None, (picture,))
    stream, rig = LiveStream(LAYOUT, 64), assumed_rig(LAYOUT, 64)
    return Lookout(received, PlacedCamera(stream, rig, Pose.identity(), None, "", 0), LAST)


def relocation(locate, look=lookout):
    got = SimpleNamespace(done=[], failed=[])
    made = Relocation(locate, look, done=got.done.append, failed=got.failed.append)
    return made, got


def settle(made):
    while made.is_running:
        threading.Event().wait(0.005)


def test_a_search_has_the_newest_pictures_and_the_last_pose():
    seen = []

    def locate(frame, last_world_from_rig):
        seen.append((frame.seq, len(frame.images), last_world_from_rig))
        return "here"

    made, got = relocation(locate)
    made.start()
    settle(made)
    assert seen == [(7, 2, LAST)]
    assert got.done == ["here"]
    assert got.failed == []


def test_it_is_searched_for_every_so_often_until_it_is_found():
    count = []
    made, _ = relocation(lambda frame, last: count.append(1))
    for now_ns in (0, 1, EVERY_NS // 2):
        made.notice(LOST if not now_ns else (), now_ns)
        settle(made)
    assert (made.is_lost, len(count)) == (True, 1)
    made.notice((), EVERY_NS)
    settle(made)
    assert len(count) == 2
    made.notice(FOUND, EVERY_NS + 1)
    made.notice((), 10 * EVERY_NS)
    settle(made)
    assert (made.is_lost, len(count)) == (False, 2)


def test_one_search_at_a_time():
    goes_on, count = threading.Event(), []

    def locate(frame, last_world_from_rig):
        count.append(1)
        goes_on.wait(10)

    made, _ = relocation(locate)
    for _ in range(5):
        made.start()
    assert made.is_running
    goes_on.set()
    settle(made)
    assert len(count) == 1


def test_a_room_that_cannot_be_searched_is_said_and_no_picture_is_no_search():
    def locate(frame, last_world_from_rig):
        raise ValueError("the room is too small to stand in")

    made, got = relocation(locate)
    made.start()
    settle(made)
    assert got.failed == ["the room is too small to stand in"]
    made, got = relocation(locate, look=lambda: None)
    made.start()
    settle(made)
    assert got.failed == got.done == []
