"""Connections that break are made again; silence is noticed; who closes waits for nobody."""

from __future__ import annotations

import socket
import threading
import time

import pytest

from devices.clock import WallClock
from devices.hololens.links.connection import (
    Connection,
    HeadsetLeftError,
    HeadsetSilentError,
    StoppedError,
)
from devices.hololens.links.health import StreamHealth
from devices.hololens.links.link import Link
from devices.hololens.values import StreamState


@pytest.fixture
def server():
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(5.0)
        yield listening


def connected(server, **more):
    given = {"stop": threading.Event(), "silent_s": 0.3, **more}
    return Connection(server.getsockname()[:2], WallClock(), **given)


def test_bytes_come_in_the_number_that_is_asked_for(server):
    connection = connected(server)
    other, _ = server.accept()
    other.sendall(b"abcdef")
    assert connection.take(2) == b"ab"
    assert connection.take(4) == b"cdef"
    with pytest.raises(HeadsetSilentError, match=r"nothing came for 0\.3 s"):
        connection.take(1)
    other.close()
    with pytest.raises(HeadsetLeftError, match="hung up"):
        connection.take(1)
    connection.close()


def test_memory_grows_with_what_came_not_with_what_was_promised(server):
    stop = threading.Event()
    connection = connected(server, stop=stop, silent_s=5.0)
    other, _ = server.accept()
    stop.set()
    with pytest.raises(StoppedError):
        connection.take(1 << 40)
    connection.close()
    other.close()


def test_nobody_there_is_said():
    with socket.create_server(("127.0.0.1", 0)) as gone:
        address = gone.getsockname()[:2]
    with pytest.raises(HeadsetLeftError, match="start the streaming app"):
        Connection(address, WallClock(), stop=threading.Event(), silent_s=1.0)


def test_what_breaks_is_connected_again(server):
    clock = WallClock()
    health = StreamHealth("body", clock)

    def talk(connection):
        while True:
            connection.take(1)
            health.came(1)

    link = Link(
        server.getsockname()[:2], clock, health=health, talk=talk, name="test", retry_s=0.01
    )
    for _ in range(3):
        other, _ = server.accept()
        other.sendall(b"x")
        other.close()
    deadline = time.monotonic() + 120
    while health.status().received < 3 and time.monotonic() < deadline:
        time.sleep(0.01)
    assert health.status().connections >= 3
    assert health.status().received == 3
    link.close()
    assert health.status().state is StreamState.CLOSED
    kinds = [event.kind for event in health.take_events()]
    assert "body-live" in kinds
    assert "body-waiting" in kinds


def test_a_stream_that_stops_is_held():
    clock = WallClock()
    health = StreamHealth("video", clock)
    health.came(10, delay_ns=2_000_000)
    status = health.status()
    assert status.state is StreamState.LIVE
    assert status.delay_ms == 2.0
    clock.sleep_until(clock.now_ns() + 1_100_000_000)
    assert health.status().state is StreamState.HELD
