"""Pictures of each codec, decoded with what is said of them."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from devices.clock import WallClock
from devices.hololens.camera.stream import VideoStream, is_keyframe, video_request
from devices.hololens.wire.packets import Packet
from devices.hololens.wire.personal_video import Profile, VideoTrailer, encode_trailer
from devices.hololens.wire.taking import WireError
from sim.hololens.drawing.encoder import encoder_for

SIZE = 424, 240


def pictures(count):
    """A bright square that moves over grey."""
    for number in range(count):
        rgb = np.full((SIZE[1], SIZE[0], 3), 90, np.uint8)
        rgb[60:120, 20 + 8 * number : 80 + 8 * number] = (230, 200, 40)
        yield rgb


def packets_of(codec, count=12):
    encoder = encoder_for(video_request(*SIZE, fps=30, codec=codec))
    for number, rgb in enumerate(pictures(count)):
        trailer = VideoTrailer((400.0 + number, 400.0), (212.0, 120.0), *SIZE)
        yield Packet(1000 + number, encoder.encode(rgb) + encode_trailer(trailer))


@pytest.mark.parametrize("codec", ["h264", "hevc", "raw"])
def test_every_picture_comes_with_its_own_trailer(codec):
    came, done = [], threading.Event()

    def take(decoded):
        came.append(decoded)
        if len(came) == 12:
            done.set()

    stream = VideoStream(codec, WallClock(), hand_out=take)
    for number, packet in enumerate(packets_of(codec)):
        stream.put(packet, number)
        # Where every picture is whole by itself, a newer one replaces what waits.
        until = time.monotonic() + 120
        while codec == "raw" and len(came) <= number and time.monotonic() < until:
            time.sleep(0.002)
    done.wait(10.0)
    stream.close()
    assert [each.seq for each in came] == list(range(12))
    for number, (each, rgb) in enumerate(zip(came, pictures(12), strict=True)):
        assert each.trailer.focal[0] == 400.0 + number
        assert each.packet.ticks == 1000 + number
        found = each.picture.rgb()
        assert found.shape == rgb.shape
        # Twice as coarse in colour as in brightness: edges differ.
        assert np.median(np.abs(found.astype(int) - rgb)) <= 6


@pytest.mark.parametrize("codec", ["h264", "hevc"])
def test_keyframes_are_found(codec):
    encoder = encoder_for(video_request(*SIZE, fps=30, codec=codec))
    units = [encoder.encode(rgb) for rgb in pictures(32)]
    assert [is_keyframe(codec, unit) for unit in units] == [n % 30 == 0 for n in range(32)]
    assert not is_keyframe(codec, b"")
    assert not is_keyframe(codec, b"\x00\x00\x01")


def test_h264_units_begin_with_a_delimiter_and_parameter_sets():
    encoder = encoder_for(video_request(*SIZE, fps=30, codec="h264"))
    units = [encoder.encode(rgb) for rgb in pictures(3)]
    assert all(unit[:5] == b"\x00\x00\x00\x01\x09" for unit in units)
    assert units[0][6:10] == b"\x00\x00\x00\x01"
    assert units[0][10] & 31 == 7


def test_pictures_that_are_none_are_refused():
    stream = VideoStream("raw", WallClock(), hand_out=lambda _: None)
    with pytest.raises(WireError, match="least 80"):
        stream.put(Packet(0, b"short"), 0)
    with pytest.raises(WireError, match="wanted"):
        stream.put(Packet(0, encode_trailer(VideoTrailer((1.0, 1.0), (1.0, 1.0), 424, 240))), 0)
    stream.close()


def test_requests_are_the_usual_client_s():
    request = video_request(760, 428, fps=30, codec="h264")
    assert request.profile is Profile.H264_MAIN
    assert request.options == ((10, 30),)
    assert request.bitrate == 1_561_344
    assert request.level == 255
    assert request.has_pose
    with pytest.raises(ValueError, match="h264, hevc, raw"):
        video_request(760, 428, fps=30, codec="mjpeg")
