"""Hostile bytes against every parser, against the clients, and against the simulated cameras."""

import gc
import socket
import threading
import time
import tracemalloc
from random import Random

import numpy as np
import pytest

from benchmarks.wire import fuzz as fuzzing
from benchmarks.wire.attack_hub import HostilePeer, attack
from benchmarks.wire.fuzz import FuzzError, FuzzTarget, fuzz, targets
from devices.camera.rtmp.amf import encode_amf
from devices.camera.rtmp.chunks import HANDSHAKE_BYTES, RtmpError, encode_message
from devices.clock import ManualClock, WallClock
from devices.insta360.commands import CameraInfo, Command, LiveRequest, set_time, start_live
from devices.insta360.errors import CameraError
from devices.insta360.osc import OscClient
from devices.insta360.packets import VIDEO, KeepAlive, Message, PacketParser, Stream, Sync, encode
from devices.insta360.preview import PreviewClient
from devices.insta360.preview_data import PreviewLimits
from devices.messages import EncodedFrame
from sim.wire.hostile import LONGEST_INPUT, hostile_bytes, hostile_stream
from sim.wire.osc_camera import OscCamera
from sim.wire.osc_server import OscServer
from sim.wire.preview_server import PreviewServer
from sim.wire.rtmp_client import RtmpClient
from sim.wire.rtsp.server import RtspServer, RtspStream

STREAMS = 1000
"""Hostile peers that each client and each simulated camera meets."""

MAX_BYTES = 48 << 20
"""Memory, bytes, that may be taken at any moment: a few packets of the largest size."""

LIMITS = PreviewLimits(connect_s=2.0, reply_s=2.0, packet_s=2.0, picture_s=2.0)
INFO = CameraInfo("IXSE42", "Insta360 X4", "v1.4.6", 0.5)


@pytest.fixture
def memory():
    """Peak of what Python took during the test."""
    gc.collect()
    tracemalloc.start()
    yield lambda: tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()


@pytest.mark.parametrize("name", sorted(targets()))
def test_every_parser_reads_or_refuses(name):
    counts = fuzz(name, 3000, first_seed=77_000)
    assert counts.inputs == counts.read + counts.refused == 3000
    assert counts.read > 0


@pytest.mark.parametrize("name", sorted(targets()))
def test_what_is_valid_is_read(name):
    target = targets()[name]
    for data in target.valid:
        target.read(data)


def test_a_defect_is_found_and_named(monkeypatch):
    def fragile(data):
        if b"\xff" in data:
            raise IndexError("beyond the end")

    broken = {"fragile": FuzzTarget((bytes(20),), fragile, (ValueError,))}
    monkeypatch.setattr(fuzzing, "targets", lambda: broken)
    with pytest.raises(FuzzError, match=r"fragile, seed \d+, \d+ bytes: IndexError: beyond"):
        fuzz("fragile", 100)


def test_the_same_seed_gives_the_same_bytes():
    valid = (encode(Sync()), encode(KeepAlive()))
    once, again = ([hostile_bytes(seed, valid) for seed in range(200)] for _time in range(2))
    assert once == again
    assert len(set(once)) > 100
    assert max(map(len, once)) <= LONGEST_INPUT
    assert list(hostile_stream(5, valid)) == list(hostile_stream(5, valid))


def from_camera():
    key = fuzzing.PICTURE
    replies = [Message(200, seq) for seq in range(1, 4)]
    return tuple(encode(p) for p in (Sync(), KeepAlive(), *replies, Stream(VIDEO, 5, key)))


def from_app():
    return tuple(
        encode(packet)
        for packet in (
            Sync(),
            KeepAlive(),
            Message(Command.SET_OPTIONS, 1, set_time(1_700_000_000, 0)),
            Message(Command.START_LIVE_STREAM, 2, start_live(LiveRequest())),
            Message(Command.STOP_LIVE_STREAM, 3),
        )
    )


def test_hostile_cameras_against_the_preview_client(memory):
    peer = HostilePeer(from_camera(), greeting=encode(Sync()))
    clock, ended, pictures = WallClock(), 0, 0
    for number in range(STREAMS):
        client = PreviewClient(*peer.address, clock=clock, limits=LIMITS)
        try:
            client.connect()
            if number % 3 == 0:
                client.info()
            for _taken in client.units():
                pictures += 1
        except CameraError:
            ended += 1
        finally:
            client.close()
    served = peer.served
    peer.close()
    assert (ended, served) == (STREAMS, STREAMS)
    assert pictures > 0, "some of them behave for a while"
    assert memory() < MAX_BYTES


def test_hostile_cameras_against_the_http_client(memory):
    peer = HostilePeer(targets()["HTTP replies"].valid)
    client = OscClient(*peer.address, clock=ManualClock(), request_s=2.0)
    read = refused = 0
    for number in range(STREAMS):
        try:
            (client.info, client.state, client.files)[number % 3]()
            read += 1
        except CameraError:
            refused += 1
    peer.close()
    assert read + refused == STREAMS
    assert read > 0
    assert memory() < MAX_BYTES


def test_hostile_apps_against_the_simulated_preview(memory):
    frame = EncodedFrame("camera", 0, 0, fuzzing.PICTURE, keyframe=True)
    clock = WallClock()
    server = PreviewServer(lambda: iter([frame]), clock, INFO)
    threads = threading.active_count()
    assert attack(server.address, from_app(), STREAMS) > 0
    with PreviewClient(*server.address, clock=clock, limits=LIMITS) as client:
        assert client.info() == INFO
        client.start()
        assert next(client.units()).unit.data == fuzzing.PICTURE
    assert server.connections == STREAMS + 1
    assert threading.active_count() <= threads + 2
    server.close()
    assert memory() < MAX_BYTES


def test_hostile_apps_against_the_simulated_http_interface(memory):
    requests = targets()["OSC requests"].valid
    head = (
        b"POST /osc/commands/execute HTTP/1.1\r\nX-XSRF-Protected: 1\r\nContent-Length: %d\r\n\r\n"
    )
    posts = (head % len(body) + body for body in requests)
    valid = (*posts, b"GET /osc/info HTTP/1.0\r\n\r\n")
    server = OscServer(OscCamera(ManualClock(), INFO))
    assert attack(server.address, valid, STREAMS) > 0
    assert OscClient(*server.address, clock=ManualClock()).info().serial == "IXSE42"
    server.close()
    assert memory() < MAX_BYTES


class Still:
    """What a player of the RTSP server is sent: nothing."""

    def take(self, timeout_s):
        time.sleep(timeout_s)

    def sent(self, unit):
        pass

    def close(self):
        pass


def test_hostile_players_against_the_rtsp_server(memory):
    stream = RtspStream("room", lambda _host: "v=0\r\n", Still, time.time_ns)
    server = RtspServer(stream, Random(1))
    threads = threading.active_count()
    assert attack(server.address, fuzzing.RTSP_REQUESTS, STREAMS) > 0
    with socket.create_connection(server.address, 5) as player:
        player.sendall(fuzzing.RTSP_REQUESTS[0])
        assert player.recv(100).startswith(b"RTSP/1.0 200 OK")
    assert server.connections == STREAMS + 1
    server.close()
    assert threading.active_count() < threads
    assert memory() < MAX_BYTES


def test_hostile_servers_against_what_pushes(memory):
    answers = (
        encode_message(20, encode_amf("_result", 1.0, {"level": "status"}, None), chunk_bytes=128),
        encode_message(20, encode_amf("onStatus", 0.0, None, {"level": "error"}), chunk_bytes=128),
        encode_message(5, bytes(4), chunk_bytes=128),
    )
    peer = HostilePeer(answers, greeting=b"\x03" + bytes(2 * HANDSHAKE_BYTES))
    refused = 0
    for _stream in range(STREAMS):
        try:
            RtmpClient("rtmp://{}:{}/live/room".format(*peer.address), timeout_s=2.0).close()
        except (OSError, RtmpError):
            refused += 1
    served = peer.served
    peer.close()
    assert served == STREAMS
    assert refused > STREAMS // 2
    assert memory() < MAX_BYTES


def test_small_pieces_are_no_way_to_much_memory():
    """One byte at a time, 30,000 of them: a parser holds the bytes, not a list of pieces."""
    rng = np.random.default_rng(3)
    body = rng.integers(0, 256, 30_000).astype(np.uint8).tobytes()
    wire = encode(Stream(VIDEO, 1, body))
    tracemalloc.start()
    parser = PacketParser()
    packets = [packet for byte in wire for packet in parser.feed(bytes([byte]))]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert packets == [Stream(VIDEO, 1, body)]
    assert peak < 10 * len(wire)
