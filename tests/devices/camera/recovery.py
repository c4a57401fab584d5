"""How long a stream takes to come back: a camera, a network that fails, a receiver, a stopwatch."""

import contextlib
import shutil
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from benchmarks.wire.relay import TcpRelay, UdpRelay
from devices.camera.address import parse_address
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock
from devices.insta360.commands import CameraInfo
from devices.video import H264Encoder
from sim.wire.preview_server import PreviewServer
from tests.devices.camera.parties.programs import (
    H264,
    PATTERN,
    free_port,
    gstreamer_lacks,
    rtsp_server,
    running,
    wait_for,
)
from tests.pushed_camera import RtmpPush, StreamOptions, numbered_pictures

SIZE, OTHER_SIZE = (640, 320), (480, 240)
FPS = 30
INFO = CameraInfo("IXSE42", "Insta360 X4", "v1.4.6", 0.8)
KINDS = ("rtmp", "rtsp", "insta360", "udp")


@dataclass
class Link:
    """A camera that is received through a relay.

    Attributes:
        relay: what fails.
        receiver: what receives.
        clock: its clock.
        restart: makes the camera start again, with its clock at 0, in another size if it can.
    """

    relay: TcpRelay | UdpRelay
    receiver: CameraReceiver
    clock: WallClock
    restart: Callable[[], None]


@contextlib.contextmanager
def linked(kind):
    """One camera of a kind, live; a skip where the program for it is missing."""
    with contextlib.ExitStack() as stack:
        link = {"rtmp": _rtmp, "rtsp": _rtsp, "insta360": _insta360, "udp": _udp}[kind](stack)
        wait_for(lambda: link.receiver.status().pictures > 5)
        yield link


def back_after_s(link, act, seconds=30.0):
    """Seconds from `act()` to the first picture that arrived after it."""
    since_ns = link.clock.now_ns()
    act()
    end_ns = link.clock.now_ns()
    wait_for(lambda: link.receiver.last.t_ns > since_ns + 50_000_000, seconds)
    return max(0, link.receiver.last.t_ns - end_ns) / 1e9


def black_hole(link, hole_s):
    """Nothing passes for that long; seconds from its end to the first picture."""
    link.relay.begin_hole()
    time.sleep(hole_s)
    return back_after_s(link, link.relay.end_hole)


def residue():
    """Threads, open files and child processes now."""
    children = 0
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(FileNotFoundError):  # a thread that has just ended
            children += len((task / "children").read_text("ascii").split())
    return threading.active_count(), len(list(Path("/proc/self/fd").iterdir())), children


def _received(stack, address):
    clock = WallClock()
    receiver = CameraReceiver(parse_address(address), clock)
    stack.callback(receiver.close)
    return clock, receiver


def _rtmp(stack):
    clock, receiver = _received(stack, "rtmp://127.0.0.1:0/live/room")
    wait_for(lambda: receiver.listening_at)
    port = int(receiver.listening_at.split(":")[2].split("/")[0])
    relay = TcpRelay(("127.0.0.1", port))
    stack.callback(relay.close)
    pushes = []

    def start(size=OTHER_SIZE):
        options = StreamOptions(FPS, 4_000_000, FPS)
        pictures = _noisy(numbered_pictures(size, FPS))
        url = f"rtmp://127.0.0.1:{relay.address[1]}/live/room"
        pushes.append(RtmpPush(url, pictures, clock, options=options))
        stack.callback(pushes[-1].close)

    def restart():
        """The old connection stays open and silent, as of a phone that lost its power."""
        relay.half_open()
        threading.Thread(target=pushes[-1].close, daemon=True).start()
        start()

    start(SIZE)
    return Link(relay, receiver, clock, restart)


def _noisy(pictures):
    """With grain, so that the stream has the rate that it is meant to have."""
    rng = np.random.default_rng(0)
    grain = rng.integers(0, 40, (8, OTHER_SIZE[1] // 2, OTHER_SIZE[0] // 2, 3)).astype(np.uint8)
    for number, picture in enumerate(pictures):
        rgb = picture.rgb.copy()
        height, width = grain.shape[1:3]
        rgb[-height:, -width:] += grain[number % len(grain)]
        yield replace(picture, rgb=rgb)


def _rtsp(stack):
    if lacks := gstreamer_lacks():
        pytest.skip(lacks)
    server = contextlib.ExitStack()
    stack.enter_context(server)
    relay = TcpRelay(("127.0.0.1", server.enter_context(rtsp_server(*SIZE, FPS))))
    stack.callback(relay.close)
    clock, receiver = _received(stack, f"rtsp://127.0.0.1:{relay.address[1]}/camera")

    def restart():
        relay.half_open()
        server.close()
        relay.target = ("127.0.0.1", server.enter_context(rtsp_server(*OTHER_SIZE, FPS)))

    return Link(relay, receiver, clock, restart)


def _insta360(stack):
    clock = WallClock()
    camera = contextlib.ExitStack()
    stack.enter_context(camera)

    def start(size):
        encoder = H264Encoder(*size, FPS, 4_000_000, keyframe_interval=FPS)
        frames = [
            frame
            for seq, picture in enumerate(numbered_pictures(size, FPS, count=2 * FPS))
            for frame in encoder.encode(np.asarray(picture.rgb), seq, picture.t_ns)
        ]
        server = PreviewServer(lambda: _endless(frames), clock, INFO)
        camera.callback(server.close)
        return server.address

    relay = TcpRelay(start(SIZE))
    stack.callback(relay.close)
    receiver = CameraReceiver(parse_address(f"insta360://127.0.0.1:{relay.address[1]}"), clock)
    stack.callback(receiver.close)

    def restart():
        relay.half_open()
        camera.close()
        relay.target = start(OTHER_SIZE)

    return Link(relay, receiver, clock, restart)


def _endless(frames):
    """The same pictures again and again, with times that grow."""
    for seq in count():
        frame = frames[seq % len(frames)]
        yield replace(frame, seq=seq, t_ns=round(seq * 1e9 / FPS))


def _udp(stack):
    program = shutil.which("ffmpeg")
    if program is None:
        pytest.skip("no ffmpeg: apt-get install ffmpeg")
    port = free_port(socket.SOCK_DGRAM)
    relay = UdpRelay(("127.0.0.1", port))
    stack.callback(relay.close)
    clock, receiver = _received(stack, f"udp://127.0.0.1:{port}")
    camera = contextlib.ExitStack()
    stack.enter_context(camera)

    def start(size):
        pattern = f"testsrc2=size={size[0]}x{size[1]}:rate={FPS}"
        target = f"udp://127.0.0.1:{relay.address[1]}?pkt_size=1316"
        quiet = (program, "-nostdin", "-hide_banner", "-loglevel", "error")
        coded = (*quiet, *PATTERN, pattern, *H264, "-g", str(FPS), "-f", "mpegts", target)
        camera.enter_context(running(*coded))

    def restart():
        camera.close()
        start(OTHER_SIZE)

    start(SIZE)
    return Link(relay, receiver, clock, restart)
