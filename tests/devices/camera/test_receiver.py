"""The receiver against the simulated camera, over real sockets on loopback."""

from __future__ import annotations

import time

import pytest

from devices.camera.address import parse_address
from devices.camera.received import CameraState
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock
from devices.streams import BoundedQueue
from devices.video import H264Decoder
from tests.pushed_camera import RtmpPush, numbered_pictures, read_number

SIZE = (320, 160)


def wait_for(truth, seconds=120.0):
    """Wait until something is so; fail if it takes longer than that."""
    end = time.monotonic() + seconds
    while not truth():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


@pytest.fixture
def clock():
    return WallClock()


@pytest.fixture
def receiver(clock):
    received = CameraReceiver(parse_address("rtmp://127.0.0.1:0/live/room"), clock)
    wait_for(lambda: received.listening_at)
    yield received
    received.close()


def kinds(receiver):
    return [event.kind for event in receiver.take_events()]


def test_pushed_pictures_arrive_newest_last(receiver, clock):
    push = RtmpPush(receiver.listening_at, numbered_pictures(SIZE, 60, count=30), clock)
    seen = []
    while not seen or seen[-1][1] < 29:
        picture = receiver.latest.take(10.0)
        assert picture is not None
        seen.append((picture.seq, read_number(picture.pictures[0].y)))
        assert picture.t_ns <= picture.decoded_ns <= clock.now_ns()
    push.close()
    assert all(seq == number for seq, number in seen)
    assert receiver.status().size_px == SIZE
    assert receiver.status().codec == "h264"
    assert receiver.last.seq == 29


def test_nothing_is_waited_for_with_a_reason(receiver):
    wait_for(lambda: receiver.status().state is CameraState.WAITING)
    assert receiver.listening_at in receiver.status().reason
    assert receiver.last is None


def test_the_last_picture_is_held_with_its_age(receiver, clock):
    RtmpPush(receiver.listening_at, numbered_pictures(SIZE, 60, count=3), clock).join(60)
    wait_for(lambda: receiver.status().state is CameraState.HELD)
    assert receiver.status().last_age_ns > 1_000_000_000
    assert read_number(receiver.last.pictures[0].y) == 2
    wait_for(lambda: "camera-held" in kinds(receiver))


def test_a_gap_is_an_event_and_the_next_camera_is_received(receiver, clock):
    RtmpPush(receiver.listening_at, numbered_pictures(SIZE, 60, count=3), clock).join(60)
    wait_for(lambda: receiver.status().state is CameraState.HELD)
    push = RtmpPush(receiver.listening_at, numbered_pictures((480, 240), 60, count=60), clock)
    wait_for(lambda: receiver.status().size_px == (480, 240))
    push.close()
    happened = kinds(receiver)
    assert happened.count("camera-connected") == 2
    assert happened.count("camera-size") == 2
    assert "camera-gap" in happened


def test_every_packet_reaches_the_sink_in_order(clock):
    packets = BoundedQueue(1000)
    receiver = CameraReceiver(parse_address("rtmp://127.0.0.1:0"), clock, packets=packets)
    wait_for(lambda: receiver.listening_at)
    RtmpPush(receiver.listening_at, numbered_pictures(SIZE, 120, count=20), clock).join(60)
    wait_for(lambda: receiver.status().pictures == 20)
    receiver.close()
    decoder = H264Decoder()
    stored = [packets.take() for _ in range(20)]
    assert [packet.seq for packet in stored] == list(range(20))
    assert packets.take() is None
    assert stored[0].keyframe
    assert all(decoder.decode(packet) is not None for packet in stored)


def test_a_full_sink_is_counted_and_said_once(clock):
    packets = BoundedQueue(5)
    receiver = CameraReceiver(parse_address("rtmp://127.0.0.1:0"), clock, packets=packets)
    wait_for(lambda: receiver.listening_at)
    RtmpPush(receiver.listening_at, numbered_pictures(SIZE, 120, count=12), clock).join(60)
    wait_for(lambda: receiver.status().pictures == 12)
    receiver.close()
    assert receiver.status().unsaved == 7
    assert kinds(receiver).count("camera-unsaved") == 1


def test_a_taken_port_fails_with_what_to_do(receiver, clock):
    port = receiver.listening_at.split(":")[2].split("/")[0]
    second = CameraReceiver(parse_address(f"rtmp://127.0.0.1:{port}"), clock)
    wait_for(lambda: second.status().state is CameraState.FAILED)
    assert "another port" in second.status().reason
    second.close()


def test_a_second_camera_is_refused_with_a_word(receiver, clock):
    first = RtmpPush(receiver.listening_at, numbered_pictures(SIZE, 30), clock)
    wait_for(lambda: receiver.status().state is CameraState.LIVE)
    second = RtmpPush(receiver.listening_at, numbered_pictures(SIZE, 30), clock, reconnects=False)
    second.join(60)
    assert "already pushing" in second.error
    assert receiver.status().state is CameraState.LIVE
    first.close()


def test_another_key_is_refused_with_what_is_wanted(receiver, clock):
    url = receiver.listening_at.replace("/room", "/other")
    push = RtmpPush(url, numbered_pictures(SIZE, 30), clock, reconnects=False)
    push.join(60)
    assert "'live/room', not for 'live/other'" in push.error
    assert receiver.status().connections == 0
