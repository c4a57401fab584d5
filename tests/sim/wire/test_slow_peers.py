"""Peers that never hang up: a byte now and then, or packets without end that say nothing."""

import socket
import threading
from itertools import count

import pytest

from devices.clock import WallClock
from devices.insta360.errors import CameraTimeoutError
from devices.insta360.osc import OscClient
from devices.insta360.packets import KeepAlive, Message, Stream, Sync, encode
from devices.insta360.preview import PreviewClient
from devices.insta360.preview_data import PreviewLimits

LIMITS = PreviewLimits(connect_s=1.0, reply_s=1.0, packet_s=1.0, picture_s=1.0)


@pytest.fixture
def endless():
    """Starts a peer that says `first`, then `piece(n)` every `every_s` until the test is over."""
    over = threading.Event()
    listener = socket.create_server(("127.0.0.1", 0))
    threads = []

    def start(first, piece, every_s):
        def run():
            connection, _from = listener.accept()
            connection.settimeout(0.2)
            with connection:
                try:
                    connection.sendall(first)
                    for number in count():
                        if over.wait(every_s):
                            return
                        connection.sendall(piece(number))
                except OSError:
                    return

        threads.append(threading.Thread(target=run, daemon=True))
        threads[-1].start()
        return listener.getsockname()[:2]

    yield start
    over.set()
    listener.close()
    for thread in threads:
        thread.join(120)


def test_a_packet_byte_by_byte_ends_in_time(endless):
    head = encode(Sync()) + (4_000_000).to_bytes(4, "little")
    address = endless(head, lambda _number: b"\x01", 0.02)
    with PreviewClient(*address, clock=WallClock(), limits=LIMITS) as client:
        with pytest.raises(CameraTimeoutError, match=r"came in part|no picture"):
            list(client.units())
        assert client.counts.bytes < 5_000


@pytest.mark.parametrize(
    "packet", [KeepAlive(), Message(8195, 0), Message(200, 999), Stream(0x30, 1, bytes(48))]
)
def test_packets_without_end_that_say_nothing_end_in_time(endless, packet):
    wire = encode(packet) * 20
    address = endless(encode(Sync()), lambda _number: wire, 0.001)
    with PreviewClient(*address, clock=WallClock(), limits=LIMITS) as client:
        with pytest.raises(CameraTimeoutError, match="no reply to GET_OPTIONS"):
            client.info()
        with pytest.raises(CameraTimeoutError, match="no picture for 1 s"):
            list(client.units())


@pytest.mark.parametrize(
    ("first", "piece"),
    [
        (b"HTTP/1.1 200 OK\r\n", b"x"),
        (b"HTTP/1.1 200 OK\r\n", b"X: y\r\n"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\n", b" "),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", b"1\r\n \r\n"),
        (b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
    ],
)
def test_a_reply_in_drops_ends_in_time(endless, first, piece):
    address = endless(first, lambda _number: piece, 0.05)
    client = OscClient(*address, clock=WallClock(), request_s=1.0)
    with pytest.raises(CameraTimeoutError, match="no whole reply within 1 s"):
        client.info()
