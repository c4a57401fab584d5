"""A thousand hostile peers at each port that the studio opens, beside a real camera."""

import contextlib
import gc
import io
import random
import socket
import threading
import time
import tracemalloc
from pathlib import Path

import av
import numpy as np
import pytest

from benchmarks.wire.attack_hub import attack
from devices.camera.address import parse_address
from devices.camera.received import CameraState
from devices.camera.receiver import CameraReceiver
from devices.camera.rtmp.amf import encode_amf
from devices.camera.rtmp.chunks import HANDSHAKE_BYTES, encode_message
from devices.clock import WallClock
from devices.video import H264Encoder
from sim.wire.flv_packets import avc_header, avc_picture
from sim.wire.hostile import hostile_bytes
from tests.devices.camera.parties.programs import free_port, wait_for
from tests.pushed_camera import RtmpPush, numbered_pictures, read_number

STREAMS = 1000
SIZE, FPS = (320, 160), 30

MAX_BYTES = 96 << 20
"""Memory of Python that may be taken at any moment: a dozen connections of the largest message."""

MAX_PROCESS_BYTES = 400 << 20
"""Resident memory of the process that reads UDP: FFmpeg's libraries are a third of it."""


@pytest.fixture
def memory():
    gc.collect()
    tracemalloc.start()
    yield lambda: tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()


def publisher():
    """What a friendly camera sends, piece by piece, and whole."""
    (frame,) = H264Encoder(*SIZE, FPS, 500_000).encode(
        np.asarray(next(numbered_pictures(SIZE, FPS)).rgb), 0, 0
    )
    pieces = (
        b"\x03" + bytes(HANDSHAKE_BYTES),
        bytes(HANDSHAKE_BYTES),
        encode_message(1, (4096).to_bytes(4, "big"), chunk_bytes=128),
        encode_message(20, encode_amf("connect", 1.0, {"app": "live"}), chunk_bytes=4096),
        encode_message(20, encode_amf("createStream", 2.0, None), chunk_bytes=4096),
        encode_message(
            20, encode_amf("publish", 3.0, None, "room", "live"), chunk_bytes=4096, stream=1
        ),
        encode_message(9, avc_header(frame.data), chunk_bytes=4096, channel=4, stream=1),
        encode_message(
            9, avc_picture(frame.data, keyframe=True), chunk_bytes=4096, channel=4, stream=1
        ),
    )
    return (*pieces, b"".join(pieces[:6]), b"".join(pieces))


def rss_of_children():
    total = 0
    for task in Path("/proc/self/task").iterdir():
        for child in (task / "children").read_text("ascii").split():
            pages = int(Path(f"/proc/{child}/statm").read_text("ascii").split()[1])
            total = max(total, pages * 4096)
    return total


def test_hostile_publishers_beside_a_camera(memory):
    clock = WallClock()
    receiver = CameraReceiver(parse_address("rtmp://127.0.0.1:0/live/room"), clock)
    wait_for(lambda: receiver.listening_at)
    port = int(receiver.listening_at.split(":")[2].split("/")[0])
    push = RtmpPush(receiver.listening_at, numbered_pictures(SIZE, FPS), clock)
    wait_for(lambda: receiver.status().pictures > 5)
    threads = threading.active_count()
    attack(("127.0.0.1", port), publisher(), STREAMS)
    assert threading.active_count() <= threads
    status = receiver.status()
    assert status.state is CameraState.LIVE
    assert (status.connections, push.connections) == (1, 1), "nobody took its place"
    number = read_number(receiver.last.pictures[0].y)
    assert push.sent - number < 2 * FPS, "and it is received as it is sent"
    push.close()
    receiver.close()
    assert memory() < MAX_BYTES


def test_hostile_publishers_before_a_camera(memory):
    clock = WallClock()
    receiver = CameraReceiver(parse_address("rtmp://127.0.0.1:0/live/room"), clock)
    wait_for(lambda: receiver.listening_at)
    port = int(receiver.listening_at.split(":")[2].split("/")[0])
    attack(("127.0.0.1", port), publisher(), STREAMS, first_seed=50_000)
    before = receiver.status().pictures
    push = RtmpPush(receiver.listening_at, numbered_pictures(SIZE, FPS), clock)
    wait_for(lambda: receiver.status().pictures > before + 10)
    assert receiver.status().size_px == SIZE
    push.close()
    receiver.close()
    assert memory() < MAX_BYTES


def test_connections_that_say_nothing_keep_no_camera_out():
    clock = WallClock()
    receiver = CameraReceiver(parse_address("rtmp://127.0.0.1:0/live/room"), clock)
    wait_for(lambda: receiver.listening_at)
    port = int(receiver.listening_at.split(":")[2].split("/")[0])
    idle = [socket.create_connection(("127.0.0.1", port), 5) for _ in range(64)]
    push = RtmpPush(receiver.listening_at, numbered_pictures(SIZE, FPS), clock)
    wait_for(lambda: receiver.status().pictures > 5)
    assert push.connections == 1
    for connection in idle:
        connection.close()
    push.close()
    receiver.close()


@pytest.fixture(scope="module")
def transport_stream():
    """Two seconds of a camera as datagrams of seven packets."""
    file = io.BytesIO()
    with av.open(file, "w", format="mpegts") as container:
        stream = container.add_stream("libx264", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        stream.options = {"tune": "zerolatency", "g": "15"}
        for picture in numbered_pictures(SIZE, FPS, count=2 * FPS):
            frame = av.VideoFrame.from_ndarray(picture.rgb, format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    whole = file.getvalue()
    return [whole[at : at + 1316] for at in range(0, len(whole), 1316)]


class UdpCamera:
    """Sends the same two seconds again and again."""

    def __init__(self, port, datagrams):
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(port, datagrams), daemon=True)
        self._thread.start()

    def _run(self, port, datagrams):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.connect(("127.0.0.1", port))
            while True:
                for data in datagrams:
                    with contextlib.suppress(ConnectionRefusedError):
                        sender.send(data)
                    if self._stop.wait(2.0 / len(datagrams)):
                        return

    def close(self):
        self._stop.set()
        self._thread.join()


def hostile_datagrams(port, valid, count):
    rng = random.Random(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for seed in range(count):
            data = hostile_bytes(seed, valid)
            if seed % 2:  # half of them are whole packets, and get as far as FFmpeg where they may
                size = max(1, len(data) // 188) * 188
                packets = bytearray(data[:size].ljust(size, b"\xff"))
                packets[::188] = b"\x47" * (size // 188)
                data = bytes(packets)
            sender.sendto(data, ("127.0.0.1", port))
            if rng.random() < 0.2:
                time.sleep(0.001)


def test_hostile_datagrams_beside_a_camera(memory, transport_stream):
    port = free_port(socket.SOCK_DGRAM)
    receiver = CameraReceiver(parse_address(f"udp://127.0.0.1:{port}"), WallClock())
    camera = UdpCamera(port, transport_stream)
    wait_for(lambda: receiver.status().pictures > 5)
    damaged = receiver.status().damaged
    hostile_datagrams(port, transport_stream, STREAMS)
    before = receiver.status().pictures
    wait_for(lambda: receiver.status().pictures > before + FPS)
    status = receiver.status()
    assert (status.connections, status.size_px) == (1, SIZE)
    assert status.damaged - damaged <= 2, "the end of the two seconds, and no packet of the others"
    assert 0 < rss_of_children() < MAX_PROCESS_BYTES
    camera.close()
    receiver.close()
    assert memory() < MAX_BYTES


def test_hostile_datagrams_before_a_camera(memory, transport_stream):
    port = free_port(socket.SOCK_DGRAM)
    receiver = CameraReceiver(parse_address(f"udp://127.0.0.1:{port}"), WallClock())
    wait_for(lambda: f":{port:04X} " in Path("/proc/net/udp").read_text("ascii"))
    hostile_datagrams(port, transport_stream, STREAMS)
    assert rss_of_children() < MAX_PROCESS_BYTES
    before = receiver.status().pictures
    camera = UdpCamera(port, transport_stream)
    wait_for(lambda: receiver.status().pictures > before + FPS)
    assert receiver.status().size_px == SIZE
    camera.close()
    receiver.close()
    assert memory() < MAX_BYTES
