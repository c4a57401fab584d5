import socket
import threading
import time
from itertools import count, islice

import pytest

from benchmarks.wire.fuzz import PICTURE
from devices.clock import WallClock
from devices.insta360.commands import CameraInfo, Command, refusal
from devices.insta360.packets import (
    KeepAlive,
    Message,
    PacketParser,
    Stream,
    Sync,
    encode,
)
from devices.insta360.preview import PreviewClient
from devices.messages import EncodedFrame
from sim.wire import preview_server
from sim.wire.preview_server import PreviewFaults, PreviewServer

INFO = CameraInfo("IXSE42", "Insta360 X4", "v1.4.6", 0.5)


def frames(number=None, *, size=0, step_ns=10_000_000):
    seqs = count() if number is None else range(number)
    for seq in seqs:
        yield EncodedFrame("camera", seq, seq * step_ns, PICTURE + bytes([seq % 256]) * size, True)


@pytest.fixture
def server():
    made = PreviewServer(lambda: frames(8), WallClock(), INFO)
    yield made
    made.close()


def gone(name):
    """Whether no thread of that name is left, waiting for it."""
    until = time.monotonic() + 120
    while any(thread.name == name for thread in threading.enumerate()):
        if time.monotonic() > until:
            return False
        time.sleep(0.02)
    return True


class Raw:
    """A client of bare bytes."""

    def __init__(self, server):
        self._socket = socket.create_connection(server.address, 5)
        self._parser = PacketParser()
        self._packets = []

    def say(self, *packets):
        self._socket.sendall(b"".join(map(encode, packets)))

    def next(self):
        """The next packet; None when the camera hung up."""
        while not self._packets:
            data = self._socket.recv(65536)
            if not data:
                return None
            self._packets += self._parser.feed(data)
        return self._packets.pop(0)

    def close(self):
        self._socket.close()


@pytest.fixture
def raw(server):
    client = Raw(server)
    yield client
    client.close()


def test_sync_and_keep_alive_come_back(raw):
    raw.say(Sync(), KeepAlive())
    assert (raw.next(), raw.next()) == (Sync(), KeepAlive())


def test_what_it_does_not_know_it_refuses_in_words(raw):
    raw.say(Message(77, 5), Message(Command.GET_OPTIONS, 6, b"\xff"))
    unknown, broken = raw.next(), raw.next()
    assert (unknown.code, unknown.seq, refusal(unknown)) == (501, 5, "code 501: unknown command")
    assert (broken.code, broken.seq) == (400, 6)
    assert "cut off" in refusal(broken)


def test_a_preview_begins_anew_with_every_start(raw):
    for seq in (1, 2):
        raw.say(Message(Command.START_LIVE_STREAM, seq))
        assert raw.next() == Message(200, seq)
        times = [raw.next().stamp for _unit in range(8)]
        assert times == [10 * index for index in range(8)]


def test_after_a_stop_nothing_comes(server):
    endless = PreviewServer(frames, WallClock(), INFO)
    raw = Raw(endless)
    raw.say(Message(Command.START_LIVE_STREAM, 1))
    assert raw.next() == Message(200, 1)
    assert isinstance(raw.next(), Stream)
    raw.say(Message(Command.STOP_LIVE_STREAM, 2))
    while isinstance(packet := raw.next(), Stream):
        pass
    assert packet == Message(200, 2)
    raw.say(KeepAlive())
    assert raw.next() == KeepAlive()
    raw.close()
    endless.close()


def test_garbage_is_answered_by_hanging_up(raw):
    raw.say(Sync())
    assert raw.next() == Sync()
    raw._socket.sendall(b"\xff" * 16)
    try:
        assert raw.next() is None
    except ConnectionResetError:
        return  # it hung up before it had read everything


def test_a_silent_client_is_left(server, raw, monkeypatch):
    monkeypatch.setattr(preview_server, "SILENCE_S", 1.0)
    raw.say(Sync())
    assert raw.next() == Sync()
    assert raw.next() is None


def test_a_client_that_takes_nothing_is_left_and_does_not_hold_the_feed(monkeypatch):
    monkeypatch.setattr(preview_server, "SEND_S", 0.4)
    server = PreviewServer(lambda: frames(size=500_000, step_ns=1000), WallClock(), INFO)
    lazy = Raw(server)
    lazy.say(Message(Command.START_LIVE_STREAM, 1))
    assert lazy.next() == Message(200, 1)
    assert gone("camera 6666 sends")
    assert gone("camera 6666 reads")
    lazy.close()
    server.close()


def test_a_clock_that_drifts_is_seen_in_the_time_stamps():
    server = PreviewServer(lambda: frames(8), WallClock(), INFO, tick_ns=1000)
    server.faults = PreviewFaults(drift_ppm=1000.0)
    with PreviewClient(*server.address, clock=WallClock()) as client:
        client.start()
        stamps = [taken.unit.stamp for taken in islice(client.units(), 8)]
    assert stamps == [10_010 * index for index in range(8)]
    server.close()


def test_jitter_delays_and_keeps_the_order(server):
    server.faults = PreviewFaults(jitter_s=0.05)
    with PreviewClient(*server.address, clock=WallClock()) as client:
        client.start()
        stamps = [taken.unit.stamp for taken in islice(client.units(), 8)]
    assert stamps == [10 * index for index in range(8)]


def test_the_port_is_free_again_after_closing(server):
    address = server.address
    server.close()
    server.close()
    again = PreviewServer(lambda: frames(1), WallClock(), INFO, port=address[1])
    assert again.address == address
    again.close()
