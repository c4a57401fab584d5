"""Debian's ffmpeg pushes RTMP, sends MPEG-TS over UDP and makes HLS; the receiver shows it."""

import socket

import pytest

from devices.camera.received import CameraState
from tests.devices.camera.parties.programs import (
    free_port,
    http_server,
    receiving,
    running,
    wait_for,
)


def seen(receiver, pictures):
    wait_for(lambda: receiver.status().pictures >= pictures)
    return receiver.status()


def test_rtmp_pushed_by_ffmpeg_is_received(ffmpeg):
    with receiving("rtmp://127.0.0.1:0/live/room") as receiver:
        wait_for(lambda: receiver.listening_at)
        with running(*ffmpeg("640x320", 30, "-f", "flv", receiver.listening_at)):
            status = seen(receiver, 40)
    assert (status.size_px, status.codec, status.damaged) == ((640, 320), "h264", 0)


@pytest.mark.parametrize("codec", ["h264", "hevc"])
def test_a_transport_stream_over_udp_is_received(ffmpeg, codec):
    port = free_port(socket.SOCK_DGRAM)
    coder = (
        () if codec == "h264" else ("-c:v", "libx265", "-x265-params", "log-level=none:bframes=0")
    )
    target = ("-f", "mpegts", f"udp://127.0.0.1:{port}?pkt_size=1316")
    with receiving(f"udp://127.0.0.1:{port}") as receiver:
        wait_for(lambda: receiver.status().state is CameraState.WAITING)
        assert "waiting for a camera to send to" in receiver.status().reason
        with running(*ffmpeg("640x320", 30, *coder, *target)):
            status = seen(receiver, 40)
    assert (status.size_px, status.codec, status.damaged) == ((640, 320), codec, 0)


def test_a_stream_that_runs_already_is_received_from_its_next_keyframe(ffmpeg):
    port = free_port(socket.SOCK_DGRAM)
    target = ("-f", "mpegts", f"udp://127.0.0.1:{port}?pkt_size=1316")
    with (
        running(*ffmpeg("640x320", 30, *target)),
        receiving(f"udp://127.0.0.1:{port}") as receiver,
    ):
        status = seen(receiver, 40)
    assert status.size_px == (640, 320)
    assert status.damaged == 0


def test_hls_is_received(ffmpeg, tmp_path):
    live = ("-f", "hls", "-hls_time", "1", "-hls_list_size", "4", "-hls_flags", "delete_segments")
    with (
        http_server(tmp_path) as port,
        running(*ffmpeg("640x320", 30, *live, str(tmp_path / "live.m3u8"))),
        receiving(f"http://127.0.0.1:{port}/live.m3u8") as receiver,
    ):
        status = seen(receiver, 60)
    assert (status.size_px, status.codec, status.damaged) == ((640, 320), "h264", 0)
