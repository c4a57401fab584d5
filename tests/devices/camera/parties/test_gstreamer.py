"""GStreamer's RTSP server, in a process of its own, serves pictures over TCP and over UDP."""

import pytest

from tests.devices.camera.parties.programs import receiving, wait_for


@pytest.mark.parametrize("scheme", ["rtsp", "rtsp+udp"])
def test_rtsp_is_received(gstreamer, scheme):
    with (
        gstreamer(640, 320, 30) as port,
        receiving(f"{scheme}://127.0.0.1:{port}/camera") as receiver,
    ):
        wait_for(lambda: receiver.status().pictures >= 40)
        status = receiver.status()
    assert (status.size_px, status.codec, status.damaged) == ((640, 320), "h264", 0)
    assert status.connections == 1


def test_a_wrong_path_says_so_and_is_tried_again(gstreamer):
    with (
        gstreamer(640, 320, 30) as port,
        receiving(f"rtsp://127.0.0.1:{port}/nothing") as receiver,
    ):
        wait_for(lambda: "trying again" in receiver.status().reason)
        assert "is the camera on, and its address right?" in receiver.status().reason


def test_a_server_that_starts_again_is_found_again(gstreamer):
    with (
        gstreamer(640, 320, 30) as port,
        receiving(f"rtsp://127.0.0.1:{port}/camera") as receiver,
    ):
        wait_for(lambda: receiver.status().pictures >= 10)
    with receiving(f"rtsp://127.0.0.1:{port}/camera") as receiver:
        wait_for(lambda: "trying again" in receiver.status().reason)
        with gstreamer(480, 240, 30, port):
            wait_for(lambda: receiver.status().size_px == (480, 240))
