import socket

import pytest

from devices.clock import WallClock
from tests.pushed_camera import RtmpPush, numbered_pictures


def test_without_a_server_it_says_why_and_ends(unused_port):
    url = f"rtmp://127.0.0.1:{unused_port}/live/room"
    push = RtmpPush(url, numbered_pictures((64, 32), 30), WallClock(), reconnects=False)
    push.join(120)
    assert not push.is_running
    assert "refused" in push.error.lower()


def test_it_stops_while_it_tries_again(unused_port):
    url = f"rtmp://127.0.0.1:{unused_port}/live/room"
    push = RtmpPush(url, numbered_pictures((64, 32), 30), WallClock())
    push.close()
    assert not push.is_running


@pytest.fixture
def unused_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
