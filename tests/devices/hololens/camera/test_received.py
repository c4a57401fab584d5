"""Messages between the process that receives video and the one that asks."""

from __future__ import annotations

import io

import numpy as np

from devices.hololens.camera.received import (
    PICTURE,
    STATUS,
    UNIT,
    WANTS_CAMERA,
    pack_picture,
    pack_status,
    pack_unit,
    pack_wish,
    read_message,
    read_picture,
    read_status,
    read_unit,
)
from devices.hololens.camera.stream import DecodedVideo
from devices.hololens.values import StreamState, StreamStatus
from devices.hololens.wire.packets import Packet
from devices.hololens.wire.personal_video import VideoTrailer
from tests.stream_pictures import picture_from_rgb


def test_messages_come_back_in_order():
    rgb = np.random.default_rng(0).integers(0, 255, (60, 80, 3)).astype(np.uint8)
    picture = picture_from_rgb(rgb)
    pose = np.arange(16, dtype=np.float32).reshape(4, 4)
    trailer = VideoTrailer((1.0, 2.0), (3.0, 4.0), 80, 60)
    decoded = DecodedVideo(7, Packet(99, b"", pose), 0, trailer, picture)
    status = StreamStatus(StreamState.WAITING, "trying again", received=3, connections=2)
    stream = io.BufferedReader(
        io.BytesIO(
            pack_wish()
            + pack_picture(decoded)
            + pack_status(status)
            + pack_unit(5, b"unit", is_keyframe=True, begins=False)
        )
    )
    assert read_message(stream) == (WANTS_CAMERA, b"")
    kind, body = read_message(stream)
    assert kind == PICTURE
    found = read_picture(body, 11)
    assert (found.seq, found.packet.ticks, found.arrived_ns) == (7, 99, 11)
    assert found.trailer == trailer
    assert np.array_equal(found.packet.pose, pose)
    assert np.array_equal(found.picture.y, picture.y)
    assert np.array_equal(found.picture.v, picture.v)
    assert (found.picture.is_full_range, found.picture.matrix) == (True, "bt601")
    kind, body = read_message(stream)
    assert (kind, read_status(body)) == (STATUS, status)
    kind, body = read_message(stream)
    assert (kind, read_unit(body)) == (UNIT, (5, True, False, b"unit"))
    assert read_message(stream) is None
