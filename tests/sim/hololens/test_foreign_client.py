"""The simulated headset as a client meets it who knows the protocol's tables and nothing else."""

from __future__ import annotations

import itertools
import socket
import struct
import time

import av
import numpy as np
import pytest

from devices.clock import WallClock
from sim.hololens.simulator import Simulator, SimulatorPlan

FILETIME_1970 = 116_444_736_000_000_000


@pytest.fixture(scope="module")
def headset(small_room):
    simulator = Simulator(SimulatorPlan(small_room), WallClock())
    yield simulator
    simulator.close()


class Wire:
    """A socket, and exactly so many bytes of it."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), 10.0)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, layout, *values):
        self.socket.sendall(struct.pack("<" + layout, *values))

    def take(self, count):
        data = b""
        while len(data) < count:
            piece = self.socket.recv(count - len(data))
            if not piece:
                raise EOFError
            data += piece
        return data

    def values(self, layout):
        return struct.unpack("<" + layout, self.take(struct.calcsize("<" + layout)))


def packet(wire, has_pose):
    ticks, size = wire.values("QI")
    payload = wire.take(size)
    pose = np.array(wire.values("16f")).reshape(4, 4) if has_pose else None
    return ticks, payload, pose


def start_camera(headset):
    with Wire(headset.ports.video) as wire:
        wire.send("B7B3f2I", 7, 0, 0, 0, 0, 0, 0, 0, 0.9, 0, 0, 0, 1)
    with Wire(headset.ports.configuration) as wire:
        for _ in range(100):
            wire.send("B", 3)
            if wire.values("B") == (1,):
                return
            time.sleep(0.05)
    raise AssertionError("the camera did not start")


def stream_request(profile, bitrate=400_000):
    request = struct.pack("<BHHBBBBIB", 1, 424, 240, 30, 1, profile, 255, bitrate, 1)
    return request + struct.pack("<QQ", 10, 30)


def test_configuration(headset):
    with Wire(headset.ports.configuration) as wire:
        wire.send("B", 0)
        assert wire.values("4H") == (1, 0, 37, 0)
        wire.send("B", 1)
        (offset,) = wire.values("Q")
        wire.send("BI", 0x18, 0)
        (own,) = wire.values("Q")
        wire.send("BI", 0x18, 1)
        (utc,) = wire.values("Q")
        assert abs(own + offset - utc) < 10_000_000
        assert abs((utc - FILETIME_1970) / 1e7 - time.time()) < 5.0
        # Settings have no answer; what is asked next has.
        wire.send("B5I", 4, 1, 2, 3, 4, 5)
        wire.send("BI4f", 0x13, 1, 0.0, 0.0, 1.0, 1.0)
        wire.send("B3I4f", 0x16, 3800, 0, 2, 320.0, 240.0, 770.0, 240.0)
        assert wire.values("4f") == pytest.approx((0, 0, 1, 0))
        wire.send("BIQ", 0x17, 1, own)
        rig = np.array(wire.values("16f")).reshape(4, 4)
        assert rig[3, 3] == 1.0
        assert np.allclose(rig[:3, :3] @ rig[:3, :3].T, np.eye(3), atol=1e-5)


@pytest.mark.parametrize(("profile", "codec"), [(0, "h264"), (1, "h264"), (2, "h264"), (3, "hevc")])
def test_video_as_clients_in_the_field_read_it(headset, profile, codec):
    start_camera(headset)
    decoder = av.CodecContext.create(codec, "r")
    shown = []
    with Wire(headset.ports.video) as wire:
        wire.socket.sendall(stream_request(profile))
        stamps = []
        while len(shown) < 5:
            ticks, payload, pose = packet(wire, True)
            stamps.append(ticks)
            unit, trailer = payload[:-80], struct.unpack("<4fQ2Q4I2f3f2H", payload[-80:])
            assert trailer[-2:] == (424, 240)
            assert 250 < trailer[0] < 450
            assert 180 < trailer[2] < 250
            assert pose[3, 3] == 1.0
            assert np.allclose(pose[:3, 3], 0)
            if codec == "h264":
                # They cut off six bytes without looking, and add a delimiter to flush.
                unit = unit[6:] + b"\x00\x00\x00\x01\x09\x10"
            for part in decoder.parse(unit):
                shown += decoder.decode(part)
            assert len(stamps) < 60
    assert (shown[0].width, shown[0].height) == (424, 240)
    assert shown[-1].to_ndarray(format="gray").mean() > 30
    assert all(after > before for before, after in itertools.pairwise(stamps))


def test_a_shared_camera_keeps_its_own_size(headset):
    with Wire(headset.ports.video) as wire:
        wire.send("B7B3f2I", 7, 0, 0, 0, 0, 0, 0, 1, 0.9, 0, 0, 0, 1)
    with Wire(headset.ports.video) as wire:
        wire.socket.sendall(stream_request(255))
        _, first, _ = packet(wire, True)
    sizes = struct.unpack("<2H", first[-4:])
    assert sizes != (0, 0)
    stride = -(-sizes[0] // 64) * 64
    assert len(first) - 80 == stride * sizes[1] * 3 // 2
    start_camera(headset)


def test_raw_video(headset):
    start_camera(headset)
    with Wire(headset.ports.video) as wire:
        wire.socket.sendall(stream_request(255))
        _, payload, _ = packet(wire, True)
    stride = -(-424 // 64) * 64
    assert len(payload) - 80 == stride * 240 * 3 // 2


def test_calibration(headset):
    start_camera(headset)
    with Wire(headset.ports.video) as wire:
        wire.send("BHHB", 2, 424, 240, 30)
        numbers = wire.values("52f")
        projection = np.array(numbers[9:25]).reshape(4, 4)
        with pytest.raises(EOFError):
            wire.take(1)
    assert projection[0, 0] == -numbers[0]
    assert projection[1, 1] == numbers[1]


def test_head_eyes_and_hands_come_unasked_at_60_hertz(headset):
    with Wire(headset.ports.body) as wire:
        stamps, last = [], b""
        for _ in range(30):
            ticks, last, _ = packet(wire, False)
            stamps.append(ticks)
            assert len(last) == 1936
    (valid,) = struct.unpack("<I", last[:4])
    assert valid == 15
    position, forward, up = np.array(struct.unpack("<9f", last[4:40])).reshape(3, 3)
    assert np.linalg.norm(forward) == pytest.approx(1, abs=1e-5)
    assert forward @ up == pytest.approx(0, abs=1e-5)
    assert up[1] > 0.5
    # The world begins where the head was: eyes are about as high still.
    assert abs(position[1]) < 0.2
    joints = np.frombuffer(last, "<f4", 26 * 9, 64).reshape(26, 9)
    assert np.allclose(np.linalg.norm(joints[:, :4], axis=1), 1, atol=1e-5)
    assert np.ptp(joints[:, 4:7], axis=0).max() < 0.3
    usual = np.median(np.diff(stamps)) / 1e7
    assert usual == pytest.approx(1 / 60, rel=0.05) or usual > 1 / 60


def test_spatial_mapping(headset):
    time.sleep(max(0.0, 4.0 - headset.world.now_s()))
    with Wire(headset.ports.surfaces) as wire:
        wire.send("B", 1)
        assert wire.values("I") == (0,)
        wire.send("BBI6f", 0, 1, 0, 0.0, 0.0, 0.0, 20.0, 20.0, 20.0)
        wire.send("B", 1)
        (count,) = wire.values("I")
        assert count > 4
        listed = [struct.unpack("<16sq", wire.take(24)) for _ in range(count)]
        assert len({guid for guid, _ in listed}) == count
        wire.send("BI", 2, 3)
        for guid, formats in (
            (listed[0][0], (13, 57, 31)),
            (bytes(16), (13, 57, 31)),
            (listed[1][0], (2, 42, 2)),
        ):
            wire.socket.sendall(guid + struct.pack("<d4I", 1000.0, *formats, 0))
        for number, (status, vertex_bytes, index_type) in enumerate(
            ((0, 8, "<u2"), (1, 0, ""), (0, 16, "<u4"))
        ):
            header = wire.values("5I3f16f10f")
            assert header[:2] == (number, status)
            if status:
                assert header[2:5] == (0, 0, 0)
                continue
            vertices = wire.take(header[2])
            indices = np.frombuffer(wire.take(header[3]), index_type)
            wire.take(header[4])
            assert len(vertices) % vertex_bytes == 0
            assert indices.max() < len(vertices) // vertex_bytes
            raw = np.frombuffer(vertices, "<i2" if vertex_bytes == 8 else "<f4").reshape(-1, 4)
            local = raw[:, :3] * np.array(header[5:8]) / raw[:, 3:]
            world = np.hstack([local, np.ones((len(local), 1))]) @ np.array(header[8:24]).reshape(
                4, 4
            )
            # The room is 4 m wide and 2.5 m high, and the world begins at somebody's eyes.
            assert np.abs(world[:, :3]).max() < 6
            assert world[:, 1].min() > -1.8


def test_the_display_answers_in_order(headset):
    with Wire(headset.ports.display) as wire:
        for command, data in (
            (17, b""),
            (18, b""),
            (0, struct.pack("<I", 3)),
            (20, struct.pack("<I", 1)),
            (2, struct.pack("<i10f", 0, 1, 2, 3, 0, 0, 0, 1, 0.1, 0.2, 0.3)),
            (4, struct.pack("<i4f", 0, 1, 0, 0, 1)),
            (6, b""),
            (7, struct.pack("<i5f", 0, 0.4, 1, 1, 1, 1) + "grüß".encode()),
            (20, struct.pack("<I", 0)),
            (15, b"mesh"),
            (1, struct.pack("<iI", 5, 1)),
            (19, b""),
        ):
            wire.send("II", command, len(data))
            wire.socket.sendall(data)
        results = wire.values("12I")
        first = results[2]
        assert results == (1, 1, first, 1, 1, 1, first + 1, 1, 1, 0, 0, 1)
        cube, text = headset.holograms.shown()
        assert text.text == "grüß"
        assert cube.key == first
        # Unity's z, ahead, is the studio's y; its y is z.
        assert np.allclose(cube.world_from_item.translation, [1, 3, 2])
        assert np.allclose(cube.scale, [0.1, 0.3, 0.2])
        wire.send("II", 0xFFFFFFFF, 0)
        with pytest.raises(EOFError):
            wire.take(1)


def test_a_second_client_of_a_port_waits_without_a_byte(headset):
    with Wire(headset.ports.body) as first:
        packet(first, False)
        with Wire(headset.ports.body) as second:
            second.socket.settimeout(0.4)
            with pytest.raises(TimeoutError):
                second.take(1)
            first.socket.close()
            second.socket.settimeout(5.0)
            assert len(packet(second, False)[1]) == 1936


@pytest.mark.parametrize(
    "said",
    [
        b"\x2a",
        struct.pack("<BHHBBBBIB", 1, 761, 428, 30, 1, 1, 255, 1, 0),
        struct.pack("<BHHBBBBIB", 1, 760, 428, 30, 1, 9, 255, 1, 0),
    ],
)
def test_a_bad_request_is_hung_up_on(headset, said):
    with Wire(headset.ports.video) as wire:
        wire.socket.sendall(said)
        with pytest.raises(EOFError):
            wire.take(1)
