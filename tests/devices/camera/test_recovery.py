"""Streams that come back: after a black hole, a half-open socket, a restart, garbage."""

import io
import random
import socket
import threading
import time
from contextlib import suppress
from dataclasses import replace

import av
import pytest

from devices.camera.address import parse_address
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock
from tests.devices.camera.parties.programs import free_port, wait_for
from tests.devices.camera.recovery import (
    FPS,
    KINDS,
    OTHER_SIZE,
    SIZE,
    back_after_s,
    black_hole,
    linked,
    residue,
)
from tests.pushed_camera import RtmpPush, numbered_pictures

MAX_S = 15.0
"""Ceiling in the unit tests, three times the bar: other programs run beside them."""

HOLE_S = 3.0


@pytest.fixture(autouse=True)
def nothing_is_left():
    before = residue()
    yield

    def more():
        return any(now > then for now, then in zip(residue(), before, strict=True))

    end = time.monotonic() + 120
    while more() and time.monotonic() < end:
        time.sleep(0.05)
    assert not more(), (before, residue(), [thread.name for thread in threading.enumerate()])


def events(link):
    return [(event.kind, event.text) for event in link.receiver.take_events()]


@pytest.mark.parametrize("kind", KINDS)
def test_pictures_are_back_after_a_black_hole_with_its_length(kind):
    with linked(kind) as link:
        assert black_hole(link, HOLE_S) < MAX_S
        gaps = [text for event, text in events(link) if event == "camera-gap"]
        assert len(gaps) == 1
        assert HOLE_S - 0.5 < float(gaps[0].split("after ")[1].split(" s")[0]) < HOLE_S + MAX_S


@pytest.mark.parametrize("kind", ["rtsp", "insta360"])
def test_a_half_open_socket_is_replaced_by_a_new_connection(kind):
    with linked(kind) as link:
        assert back_after_s(link, link.relay.half_open) < MAX_S
        assert link.receiver.status().connections == 2


def test_a_new_rtmp_connection_wins_while_the_old_one_is_open():
    """A camera connects again at once, which it may do once: it does not try again if refused."""
    with linked("rtmp") as link:
        assert back_after_s(link, link.restart) < MAX_S
        assert link.receiver.status().connections == 2


@pytest.mark.parametrize("kind", KINDS)
def test_a_camera_that_starts_again_is_received_in_its_new_size(kind):
    with linked(kind) as link:
        link.restart()
        wait_for(lambda: link.receiver.status().size_px == OTHER_SIZE, 2 * MAX_S)
        first = link.receiver.status().pictures
        wait_for(lambda: link.receiver.status().pictures > first + 10)


@pytest.mark.parametrize("kind", KINDS)
def test_garbage_in_the_stream_is_survived(kind):
    with linked(kind) as link:
        for seed in range(3):
            link.relay.send_garbage(random.Random(seed).randbytes(700))
            time.sleep(0.2)
        before = link.receiver.status().pictures
        wait_for(lambda: link.receiver.status().pictures > before + 10, 2 * MAX_S)
        assert link.receiver.status().size_px == SIZE


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["black hole of 20 s", "half-open socket", "camera restart"])
@pytest.mark.parametrize("kind", KINDS)
def test_pictures_are_back_within_five_seconds(kind, fault, capsys):
    if fault == "half-open socket" and kind in ("udp", "rtmp"):
        pytest.skip("UDP has no connection; an RTMP camera starts again beside its half-open one")
    times = []
    for _ in range(3):
        with linked(kind) as link:
            if fault == "black hole of 20 s":
                times.append(black_hole(link, 20.0 + 1.3 * len(times)))
            else:
                act = link.restart if fault == "camera restart" else link.relay.half_open
                times.append(back_after_s(link, act))
    with capsys.disabled():
        print(f"\n{kind}, {fault}: back after", ", ".join(f"{t:.2f} s" for t in sorted(times)))
    assert sorted(times)[1] <= 5.0


def two_sizes():
    """A second in one size, then in another, on one connection."""
    yield from numbered_pictures(SIZE, FPS, count=FPS)
    yield from numbered_pictures(OTHER_SIZE, FPS, count=3 * FPS)


def test_a_resolution_that_changes_while_rtmp_is_pushed():
    clock = WallClock()
    receiver = CameraReceiver(parse_address("rtmp://127.0.0.1:0/live/room"), clock)
    wait_for(lambda: receiver.listening_at)
    pictures = (replace(p, t_ns=round(k * 1e9 / FPS)) for k, p in enumerate(two_sizes()))
    push = RtmpPush(receiver.listening_at, pictures, clock)
    wait_for(lambda: receiver.status().size_px == OTHER_SIZE)
    assert push.connections == 1
    push.close()
    receiver.close()


def test_a_resolution_that_changes_within_a_transport_stream():
    """The same sender and the same packet ids: only the parameter sets in the stream say it."""
    port = free_port(socket.SOCK_DGRAM)
    receiver = CameraReceiver(parse_address(f"udp://127.0.0.1:{port}"), WallClock())
    wait_for(lambda: "waiting" in receiver.status().reason)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for size in (SIZE, OTHER_SIZE):
            end = time.monotonic() + 120
            while receiver.status().size_px != size and time.monotonic() < end:
                for data in datagrams(size):
                    with suppress(ConnectionRefusedError):
                        sender.sendto(data, ("127.0.0.1", port))
                    time.sleep(0.002)
            assert receiver.status().size_px == size
    assert receiver.status().connections == 1
    receiver.close()


def datagrams(size):
    """A second of pictures as a transport stream, seven packets a datagram."""
    file = io.BytesIO()
    with av.open(file, "w", format="mpegts") as container:
        stream = container.add_stream("libx264", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        stream.options = {"tune": "zerolatency", "g": "15"}
        for picture in numbered_pictures(size, FPS, count=FPS):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture.rgb, format="rgb24")))
        container.mux(stream.encode())
    whole = file.getvalue()
    return [whole[at : at + 1316] for at in range(0, len(whole), 1316)]
