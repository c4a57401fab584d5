"""The receiver on a simulated Insta360 camera, over real sockets on loopback."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from benchmarks.wire.fuzz import OFFSET_V1, OFFSET_V3
from devices.camera.address import parse_address
from devices.camera.received import CameraState
from devices.camera.receiver import CameraReceiver
from devices.camera.sources.insta360_source import Insta360Source
from devices.camera.units import Idle, SourceError, Unit
from devices.clock import WallClock
from devices.insta360.commands import CameraInfo
from devices.insta360.files.lens_rig import CarriedLenses
from devices.video import H264Encoder
from sim.wire.preview_server import PreviewFaults, PreviewServer
from tests.pushed_camera import numbered_pictures, read_number

SIZE = (320, 160)
INFO = CameraInfo("IXSE42", "Insta360 X4", "v1.4.6", 0.8)


@pytest.fixture(scope="module")
def encoded():
    encoder = H264Encoder(*SIZE, 50, 2_000_000, keyframe_interval=10)
    pictures = numbered_pictures(SIZE, 50, count=400)
    return [
        frame
        for seq, picture in enumerate(pictures)
        for frame in encoder.encode(np.asarray(picture.rgb), seq, picture.t_ns)
    ]


@pytest.fixture
def clock():
    return WallClock()


@pytest.fixture
def camera(encoded, clock):
    server = PreviewServer(lambda: iter(encoded), clock, INFO)
    yield server
    server.close()


def address(server):
    host, port = server.address
    return parse_address(f"insta360://{host}:{port}")


def wait_for(truth, seconds=120.0):
    end = time.monotonic() + seconds
    while not truth():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


def test_pictures_of_the_preview_arrive_with_their_numbers(camera, clock):
    receiver = CameraReceiver(address(camera), clock)
    picture = receiver.latest.take(10.0)
    assert picture is not None
    assert read_number(picture.pictures[0].y) == picture.seq
    wait_for(lambda: receiver.last.seq > 20)
    last = receiver.last
    assert last.pts_ns <= last.t_ns <= last.decoded_ns
    assert (receiver.status().state, receiver.status().size_px) == (CameraState.LIVE, SIZE)
    receiver.close()


def test_a_camera_that_freezes_is_held_and_comes_back(camera, clock):
    receiver = CameraReceiver(address(camera), clock)
    wait_for(lambda: receiver.last is not None)
    camera.faults = PreviewFaults(frozen=True)
    wait_for(lambda: receiver.status().state is CameraState.HELD)
    camera.faults = PreviewFaults()
    wait_for(lambda: receiver.status().state is CameraState.LIVE)
    receiver.close()


def test_a_camera_that_goes_away_is_found_again(encoded, clock):
    first = PreviewServer(lambda: iter(encoded), clock, INFO)
    receiver = CameraReceiver(address(first), clock)
    wait_for(lambda: receiver.last is not None)
    port = first.address[1]
    first.close()
    wait_for(lambda: "trying again" in receiver.status().reason)
    second = PreviewServer(lambda: iter(encoded), clock, INFO, port=port)
    wait_for(lambda: receiver.status().connections == 2)
    receiver.close()
    second.close()


def test_it_sets_the_clock_and_keeps_what_the_camera_says_of_itself(camera, clock):
    source = Insta360Source(address(camera), clock, unix_s=lambda: 1_764_000_000)
    units = source.units(threading.Event())
    first = next(unit for unit in units if isinstance(unit, Unit))
    units.close()
    assert (first.keyframe, first.format.codec) == (True, "h264")
    assert source.info == INFO
    assert camera.set_times == (1_764_000_000, 0)


def test_a_stop_ends_it_while_it_connects(camera, clock):
    camera.faults = PreviewFaults(half_open=True)
    stop = threading.Event()
    units = Insta360Source(address(camera), clock).units(stop)
    assert isinstance(next(units), Idle)
    stop.set()
    assert len(list(units)) <= 1


def test_nothing_there_says_what_to_do(clock):
    server = PreviewServer(lambda: iter(()), clock, INFO)
    gone = address(server)
    server.close()
    with pytest.raises(SourceError, match=r"insta360://127.0.0.1:\d+: camera .* is the camera on"):
        list(Insta360Source(gone, clock).units(threading.Event()))


def test_the_receiver_gives_the_lenses_that_the_camera_told(encoded, clock):
    info = CameraInfo("IXSE42", "Insta360 X5", "v1", 0.8, OFFSET_V1, "", OFFSET_V3)
    server = PreviewServer(lambda: iter(encoded), clock, info)
    receiver = CameraReceiver(address(server), clock)
    try:
        assert receiver.carried_lenses() is None
        wait_for(lambda: receiver.last is not None)
        assert receiver.carried_lenses() == CarriedLenses(OFFSET_V3, "Insta360 X5")
    finally:
        receiver.close()
        server.close()
