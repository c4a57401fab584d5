"""From a drawn picture to its decoded planes: encode, send, receive, decode; printed."""

import io
import socket
import threading
import time
from fractions import Fraction

import av
import numpy as np
import pytest

from devices.camera.address import parse_address
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock
from devices.video import H264Encoder
from tests.devices.camera.parties.programs import free_port, wait_for
from tests.pushed_camera import RtmpPush, StreamOptions, numbered_pictures, paced, read_number

SIZE, FPS, COUNT = (1440, 720), 30, 300


class Stamped:
    """Pictures, and when each was drawn."""

    def __init__(self, clock):
        self.drawn_ns = {}
        self._clock = clock

    def __iter__(self):
        for number, picture in enumerate(
            paced(numbered_pictures(SIZE, FPS, count=COUNT), self._clock)
        ):
            self.drawn_ns[number] = self._clock.now_ns()
            yield picture


def send_rtmp(receiver, stamped, clock):
    push = RtmpPush(receiver.listening_at, stamped, clock, options=StreamOptions(FPS, 8_000_000))
    return push.join


def send_udp(receiver, stamped, _clock):
    """MPEG-TS of FFmpeg's own muxer, in our datagrams."""
    target = ("127.0.0.1", receiver.address.port)

    def run():
        encoder = H264Encoder(*SIZE, FPS, 8_000_000, keyframe_interval=FPS)
        file = io.BytesIO()
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
            av.open(file, "w", format="mpegts", options={"flush_packets": "1"}) as container,
        ):
            stream = container.add_stream("libx264", rate=FPS)
            stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
            for seq, picture in enumerate(stamped):
                (frame,) = encoder.encode(np.asarray(picture.rgb), seq, picture.t_ns)
                packet = av.Packet(frame.data)
                packet.pts = packet.dts = seq
                packet.time_base, packet.stream = Fraction(1, FPS), stream
                packet.is_keyframe = frame.keyframe
                container.mux(packet)
                data = file.getvalue()
                file.seek(0)
                file.truncate()
                for at in range(0, len(data), 1316):
                    sender.sendto(data[at : at + 1316], target)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread.join


@pytest.mark.slow
@pytest.mark.parametrize(
    ("address", "send"),
    [("rtmp://127.0.0.1:0/live/room", send_rtmp), ("udp://127.0.0.1:{port}", send_udp)],
    ids=["rtmp", "udp"],
)
def test_delay_from_drawn_to_decoded(address, send, capsys):
    clock = WallClock()
    port = free_port(socket.SOCK_DGRAM)
    receiver = CameraReceiver(parse_address(address.format(port=port)), clock)
    time.sleep(1.0)
    wait_for(lambda: receiver.listening_at or receiver.address.port)
    stamped = Stamped(clock)
    join = send(receiver, stamped, clock)
    delays_ms = []
    while (picture := receiver.latest.take(2.0)) is not None:
        number = read_number(picture.pictures[0].y)
        delays_ms.append((picture.decoded_ns - stamped.drawn_ns[number]) / 1e6)
    join(10)
    receiver.close()
    settled = delays_ms[FPS:]
    with capsys.disabled():
        median, p95 = np.percentile(settled, [50, 95])
        print(f"\n{address}: {len(settled)} pictures, {median:.1f} ms median, {p95:.1f} ms 95 %")
    assert len(settled) > COUNT / 2
    assert np.median(settled) < 1000
