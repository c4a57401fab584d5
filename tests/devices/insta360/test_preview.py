import socket
import threading
import time
from dataclasses import replace
from itertools import count, islice, pairwise

import pytest

from devices.insta360.commands import Command, LiveRequest
from devices.insta360.errors import (
    CameraError,
    CameraProtocolError,
    CameraRefusedError,
    CameraTimeoutError,
    CameraUnreachableError,
)
from devices.insta360.packets import (
    VIDEO,
    KeepAlive,
    Message,
    PacketParser,
    Stream,
    Sync,
    Unknown,
    encode,
)
from devices.insta360.preview import PreviewClient
from devices.insta360.preview_data import PreviewLimits
from devices.video import H264Decoder
from sim.wire.preview_server import PreviewFaults, PreviewServer
from tests.devices.insta360.conftest import INFO

SHORT = PreviewLimits(connect_s=1.5, reply_s=1.5, packet_s=1.0, picture_s=1.0)
"""Long enough for a busy machine to answer, short enough to wait for."""


class Scripted:
    """A peer that answers each packet it gets with given bytes."""

    def __init__(self, answer):
        self.got = []
        self._answer = answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    @property
    def address(self):
        return self._listener.getsockname()[:2]

    def _serve(self):
        connection, _from = self._listener.accept()
        parser = PacketParser()
        with connection:
            try:
                while data := connection.recv(4096):
                    for packet in parser.feed(data):
                        self.got.append(packet)
                        answer = self._answer(packet)
                        if answer is None:
                            return
                        connection.sendall(answer)
            except OSError:
                return

    def close(self):
        self._listener.close()
        self._thread.join(120)


@pytest.fixture
def scripted(request):
    peers = []

    def make(answer):
        peers.append(Scripted(answer))
        return peers[-1].address

    yield make
    for peer in peers:
        peer.close()


def polite(packet):
    """Sync and OK for everything."""
    if isinstance(packet, Message):
        return encode(Message(200, packet.seq))
    return encode(packet)


def test_a_preview_arrives_to_the_byte_and_can_be_decoded(camera, encoded, clock):
    with PreviewClient(*camera.address, clock=clock) as client:
        client.set_time(1_764_000_000, 3600)
        assert client.info() == INFO
        client.start()
        frames = list(islice(client.frames("camera"), len(encoded)))
        client.stop()
    assert camera.set_times == (1_764_000_000, 3600)
    assert [frame.data for frame in frames] == [frame.data for frame in encoded]
    assert [frame.keyframe for frame in frames] == [frame.keyframe for frame in encoded]
    assert [frame.seq for frame in frames] == list(range(len(encoded)))
    decoder = H264Decoder()
    pictures = [decoder.decode(frame) for frame in frames]
    assert {picture.shape for picture in pictures} == {(96, 192, 3)}


def test_times_keep_the_camera_s_pace_on_the_session_s_clock(camera, encoded, clock):
    with PreviewClient(*camera.address, clock=clock) as client:
        client.start()
        begun_ns = clock.now_ns()
        times = [frame.t_ns for frame in islice(client.frames("camera"), len(encoded))]
        assert begun_ns - 1_000_000_000 < times[0] < times[-1] <= clock.now_ns()
    assert min(b - a for a, b in pairwise(times)) > 0


def test_counts_say_what_came(camera, encoded, clock):
    with PreviewClient(*camera.address, clock=clock) as client:
        client.start(LiveRequest(gyro=True))
        list(islice(client.units(), 5))
        counts = client.counts
        assert counts.units == 5
        assert counts.packets >= 7
        assert counts.bytes >= sum(len(frame.data) for frame in encoded[:5])
        assert counts.dropped == counts.skipped == 0


def test_pictures_that_come_before_a_reply_are_kept(scripted, encoded, clock):
    def answer(packet):
        if isinstance(packet, Message) and packet.code == Command.START_LIVE_STREAM:
            early = b"".join(encode(Stream(VIDEO, f.t_ns // 1000, f.data)) for f in encoded[:3])
            other = (
                encode(Message(200, 999))
                + encode(Message(8208, packet.seq))
                + encode(Unknown(9, b""))
            )
            return early + other + encode(Message(200, packet.seq))
        return polite(packet)

    with PreviewClient(*scripted(answer), clock=clock, limits=SHORT) as client:
        client.start()
        units = [taken.unit.data for taken in islice(client.units(), 3)]
    assert units == [frame.data for frame in encoded[:3]]
    assert client.counts.skipped == 1


def test_video_that_nobody_takes_is_bounded_and_counted(scripted, encoded, clock, monkeypatch):
    monkeypatch.setattr("devices.insta360.preview.MAX_QUEUE_BYTES", 60_000)

    def answer(packet):
        if isinstance(packet, Message):
            video = b"".join(encode(Stream(VIDEO, f.t_ns // 1000, f.data)) for f in encoded)
            return video + encode(Message(200, packet.seq))
        return polite(packet)

    with PreviewClient(*scripted(answer), clock=clock, limits=SHORT) as client:
        client.start()
        kept = [client.take(0.01) for _frame in encoded]
    kept = [taken.unit.data for taken in kept if taken is not None]
    assert 0 < sum(map(len, kept)) <= 60_000
    assert client.counts.dropped == len(encoded) - len(kept) > 0
    assert kept == [frame.data for frame in encoded[-len(kept) :]]


def test_keep_alives_are_sent_while_waiting(scripted, clock, monkeypatch):
    monkeypatch.setattr("devices.insta360.preview.KEEP_ALIVE_S", 0.05)
    peer = Scripted(lambda packet: encode(packet) if isinstance(packet, Sync) else b"")
    client = PreviewClient(*peer.address, clock=clock, limits=SHORT)
    client.connect()
    with pytest.raises(CameraTimeoutError, match=r"no reply to START_LIVE_STREAM within 1\.5 s"):
        client.start()
    client.close()
    peer.close()
    assert sum(isinstance(packet, KeepAlive) for packet in peer.got) >= 2


def test_another_thread_ends_it(camera, clock):
    client = PreviewClient(*camera.address, clock=clock)
    client.connect()
    client.start()
    threading.Timer(0.1, client.close).start()
    assert len(list(client.units())) < 25
    client.close()
    assert client.take(0.01) is None


def test_closing_before_the_connection_stands_leaves_nothing_open(camera, clock):
    client = PreviewClient(*camera.address, clock=clock)
    client.close()
    with pytest.raises(CameraUnreachableError, match="closed while it connected"):
        client.connect()
    assert client.take(0.01) is None


def test_nothing_listens(clock):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()[:2]
    with pytest.raises(
        CameraUnreachableError, match=r"refused; is the camera on, its Wi-Fi joined"
    ):
        PreviewClient(*address, clock=clock).connect()
    with pytest.raises(CameraUnreachableError, match="not connected; call connect first"):
        PreviewClient(*address, clock=clock).start()


@pytest.mark.parametrize(
    ("said", "error", "words"),
    [
        (b"", CameraTimeoutError, "no handshake within 1.5 s; another app may hold the camera"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", CameraProtocolError, "packet of 1347703880 bytes"),
        (b"\x12\0\0\0\x06\0\0UCD2-other.", CameraProtocolError, "another device or firmware"),
        (
            b"\xff\x00\x00\x00\x01",
            CameraTimeoutError,
            "came in part, its rest not within|handshake",
        ),
        (None, CameraUnreachableError, "it hung up"),
    ],
)
def test_what_is_no_camera_is_said_with_its_address(scripted, clock, said, error, words):
    address = scripted(lambda _packet: said)
    with pytest.raises(error, match=f"camera 127.0.0.1:{address[1]}: .*({words})"):
        PreviewClient(*address, clock=clock, limits=SHORT).connect()


def test_a_packet_whose_rest_never_comes_ends_the_preview(scripted, clock):
    def answer(packet):
        whole = polite(packet)
        started = isinstance(packet, Message) and packet.code == Command.START_LIVE_STREAM
        return whole + b"\x00\x10\x00\x00\x01" if started else whole

    limits = PreviewLimits(packet_s=0.5)
    with PreviewClient(*scripted(answer), clock=clock, limits=limits) as client:
        client.start()
        with pytest.raises(
            CameraTimeoutError, match=r"its rest not within 0\.5 s; the Wi-Fi is too weak"
        ):
            next(client.units())


def test_a_refusal_has_the_camera_s_words(scripted, clock):
    def answer(packet):
        if isinstance(packet, Message):
            return encode(Message(500, packet.seq, b"\x12\x0fcamera is busy."))
        return polite(packet)

    client = PreviewClient(*scripted(answer), clock=clock, limits=SHORT)
    client.connect()
    with pytest.raises(CameraRefusedError, match=r"STREAM \(code 500: camera is busy"):
        client.start()
    client.close()


def test_what_it_says_of_itself_must_be_readable(scripted, clock):
    def answer(packet):
        if isinstance(packet, Message):
            return encode(Message(200, packet.seq, b"\xff\xff"))
        return polite(packet)

    client = PreviewClient(*scripted(answer), clock=clock, limits=SHORT)
    client.connect()
    with pytest.raises(CameraProtocolError, match="what it says of itself: byte 0"):
        client.info()
    client.close()


def test_another_codec_is_said(scripted, clock):
    hevc = b"\0\0\0\1\x40\x01\x0c\0\0\1\x26\x01\x80a"

    def answer(packet):
        whole = polite(packet)
        return whole + encode(Stream(VIDEO, 1, hevc)) if isinstance(packet, Message) else whole

    with PreviewClient(*scripted(answer), clock=clock, limits=SHORT) as client:
        client.start()
        with pytest.raises(CameraError, match=r"HEVC, wanted H\.264"):
            next(client.frames("camera"))


def test_a_camera_that_is_switched_off_says_so(scripted, clock):
    def answer(packet):
        if isinstance(packet, Message):
            return encode(Message(8197, 0)) + encode(Message(200, packet.seq))
        return polite(packet) if isinstance(packet, Sync) else None

    peer = scripted(answer)
    client = PreviewClient(*peer, clock=clock, limits=PreviewLimits(picture_s=5.0))
    client.connect()
    client.start()
    client._send(KeepAlive())
    with pytest.raises(CameraUnreachableError, match="it was switched off"):
        next(client.units())


def test_a_frozen_camera_is_noticed_and_one_that_thaws_goes_on(camera, encoded, clock):
    endless = (encoded[n % 10] for n in count())
    camera._feed = lambda: renumbered(endless)
    with PreviewClient(*camera.address, clock=clock, limits=SHORT) as client:
        client.start()
        next(client.units())
        camera.faults = PreviewFaults(frozen=True)
        with pytest.raises(CameraTimeoutError, match=r"connected, but no picture for 1 s"):
            list(client.units())
        camera.faults = PreviewFaults()
        assert next(client.units()).unit.data


def renumbered(frames):
    for seq, frame in enumerate(frames):
        yield replace(frame, seq=seq, t_ns=seq * 20_000_000)


def test_a_half_open_connection_is_left_and_a_new_one_works(camera, clock):
    client = PreviewClient(*camera.address, clock=clock, limits=SHORT)
    client.connect()
    camera.faults = PreviewFaults(half_open=True)
    with pytest.raises(CameraTimeoutError, match="no reply to START_LIVE_STREAM"):
        start_often(client)
    camera.faults = PreviewFaults()
    with PreviewClient(*camera.address, clock=clock) as again:
        again.start()
        assert next(again.units()).unit.keyframe
    client.close()


def start_often(client):
    """The camera may read one more command before the fault reaches it."""
    for _again in range(3):
        client.start()


def test_garbage_between_packets_is_refused_and_a_new_connection_works(camera, clock):
    camera.faults = PreviewFaults(garbage=True)

    def watch(client):
        # Garbage may arrive together with the answer to the start, or after it.
        client.start()
        return list(client.units())

    with (
        PreviewClient(*camera.address, clock=clock, limits=SHORT) as client,
        pytest.raises((CameraProtocolError, CameraTimeoutError)),
    ):
        watch(client)
    camera.faults = PreviewFaults()
    with PreviewClient(*camera.address, clock=clock) as client:
        client.start()
        assert next(client.units()).unit.keyframe


def test_a_new_client_takes_over(camera, clock):
    first = PreviewClient(*camera.address, clock=clock)
    first.connect()
    first.start()
    with PreviewClient(*camera.address, clock=clock) as second:
        second.start()
        assert len(list(islice(second.units(), 3))) == 3
        with pytest.raises(CameraUnreachableError, match="the connection broke"):
            list(first.units())
    assert camera.connections == 2


def test_a_delayed_camera_delivers_everything_later(camera, encoded, clock):
    camera.faults = PreviewFaults(delay_s=0.2)
    with PreviewClient(*camera.address, clock=clock) as client:
        begun_ns = clock.now_ns()
        client.start()
        taken = list(islice(client.units(), len(encoded)))
    assert taken[0].received_ns - begun_ns >= 200_000_000
    assert [one.unit.data for one in taken] == [frame.data for frame in encoded]


def test_threads_of_a_closed_camera_are_gone(encoded, clock):
    before = threading.active_count()
    server = PreviewServer(lambda: iter(encoded), clock, INFO)
    with PreviewClient(*server.address, clock=clock) as client:
        client.start()
        next(client.units())
    server.close()
    until = time.monotonic() + 120
    while threading.active_count() > before and time.monotonic() < until:
        time.sleep(0.01)
    assert threading.active_count() == before
