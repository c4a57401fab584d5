"""Every message's bytes, put together here by hand from the layout table, read and written."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from devices.hololens.wire import (
    message_queue,
    packets,
    personal_video,
    remote_configuration,
    spatial_input,
    spatial_mapping,
    surface_mesh,
    video_formats,
)
from devices.hololens.wire.message_queue import Command, Order
from devices.hololens.wire.personal_video import (
    CalibrationRequest,
    Profile,
    StartVideo,
    StopVideo,
    VideoRequest,
    VideoTrailer,
)
from devices.hololens.wire.remote_configuration import Request, Setting
from devices.hololens.wire.spatial_input import Valid
from devices.hololens.wire.spatial_mapping import (
    GetMeshes,
    ListSurfaces,
    ObservedSurface,
    SetVolumes,
    Volume,
    VolumeKind,
)
from devices.hololens.wire.surface_mesh import MeshReply, MeshRequest, MeshStatus
from devices.hololens.wire.taking import CutShortError, FromMemory, WireError


def le(layout: str, *values: object) -> bytes:
    """Little endian, packed."""
    return struct.pack("<" + layout, *values)


ROWS = [float(k) for k in range(1, 17)]
GUID = bytes(range(100, 116))

TRAILER = (
    le("2f", 600.5, 601.5)
    + le("2f", 380.25, 213.75)
    + le("Q", 166_667)
    + le("2Q", 3, 4)
    + le("4I", 310, 2, 800, 4600)
    + le("2f", 1.5, 2.5)
    + le("3f", 1.9, 1.0, 1.75)
    + le("2H", 760, 428)
)
"""80 bytes after a picture."""

OPENINGS = {
    "start": (
        StartVideo(True, False, True, False, True, False, True, 0.5, 1280.0, 720.0, 15, 1),
        b"\x07" + bytes([1, 0, 1, 0, 1, 0, 1]) + le("3f", 0.5, 1280, 720) + le("2I", 15, 1),
    ),
    "stop": (StopVideo(), b"\x0b"),
    "stream": (
        VideoRequest(True, 760, 428, 30, 1, Profile.H264_MAIN, 255, 1_561_344, ((10, 30),)),
        b"\x01"
        + le("2H", 760, 428)
        + bytes([30, 1, 1, 255])
        + le("I", 1_561_344)
        + b"\x01"
        + le("2Q", 10, 30),
    ),
    "stream without poses": (
        VideoRequest(False, 1920, 1080, 30, 2, Profile.RAW, 255, 1, ()),
        b"\x00" + le("2H", 1920, 1080) + bytes([30, 2, 255, 255]) + le("I", 1) + b"\x00",
    ),
    "calibration": (CalibrationRequest(760, 428, 30), b"\x02" + le("2HB", 760, 428, 30)),
}


@pytest.mark.parametrize("name", OPENINGS)
def test_openings_of_personal_video(name):
    opening, data = OPENINGS[name]
    assert personal_video.encode_opening(opening) == data
    assert personal_video.read_opening(FromMemory(data)) == opening
    assert name != "start" or len(data) == 28


def test_packets():
    pose = np.array(ROWS, np.float32).reshape(4, 4)
    data = le("QI", 987_654_321_012, 5) + b"hello" + le("16f", *ROWS)
    assert packets.encode_packet(packets.Packet(987_654_321_012, b"hello", pose)) == data
    found = packets.read_packet(FromMemory(data), has_pose=True, max_bytes=5)
    assert (found.ticks, found.payload) == (987_654_321_012, b"hello")
    assert found.pose is not None
    assert found.pose[3, 0] == 13.0
    assert found.is_located
    bare = packets.read_packet(FromMemory(data), has_pose=False, max_bytes=5)
    assert bare.pose is None
    assert not bare.is_located
    with pytest.raises(WireError, match="5, limit 4"):
        packets.read_packet(FromMemory(data), has_pose=True, max_bytes=4)


def test_a_pose_of_zeros_is_not_located():
    data = le("QI", 1, 0) + bytes(64)
    assert not packets.read_packet(FromMemory(data), has_pose=True, max_bytes=0).is_located


def test_trailers():
    assert len(TRAILER) == 80
    trailer = VideoTrailer(
        (600.5, 601.5),
        (380.25, 213.75),
        760,
        428,
        166_667,
        (3, 4),
        310,
        2,
        800,
        4600,
        (1.5, 2.5),
        (np.float32(1.9).item(), 1.0, 1.75),
    )
    assert personal_video.encode_trailer(trailer) == TRAILER
    assert personal_video.read_payload(b"picture" + TRAILER) == (b"picture", trailer)
    with pytest.raises(WireError, match="79 bytes, least 80"):
        personal_video.read_payload(TRAILER[1:])


def test_default_bitrates():
    assert personal_video.default_bitrate(760, 428, fps=30, profile=Profile.H264_MAIN) == 1_561_344
    assert personal_video.default_bitrate(760, 428, fps=30, profile=Profile.HEVC_MAIN) == 780_672


def test_delimiters_are_six_bytes():
    for delimiter in (personal_video.ACCESS_UNIT_DELIMITER, personal_video.ANY_PICTURE_DELIMITER):
        assert len(delimiter) == 6
        assert delimiter.startswith(b"\x00\x00\x00\x01\x09")


def test_calibrations():
    numbers = [float(k) for k in range(52)]
    data = le("52f", *numbers)
    found = video_formats.read_calibration(FromMemory(data))
    assert found.focal.tolist() == [0, 1]
    assert found.principal.tolist() == [2, 3]
    assert found.radial.tolist() == [4, 5, 6]
    assert found.tangential.tolist() == [7, 8]
    assert found.projection[0, 0] == 9
    assert found.extrinsics[3, 3] == 40
    assert found.frame_intrinsics.tolist() == [41, 42, 43, 44]
    assert found.frame_extrinsics.tolist() == [45, 46, 47, 48, 49, 50, 51]
    assert video_formats.encode_calibration(found) == data


def test_raw_pictures_have_rows_of_64_bytes():
    assert video_formats.raw_stride(760) == 768
    assert video_formats.raw_stride(1920) == 1920
    nv12 = np.arange(6 * 4, dtype=np.uint8).reshape(6, 4)
    data = video_formats.encode_raw(nv12)
    assert len(data) == 64 * 6
    assert data[:4] == bytes([0, 1, 2, 3])
    assert data[64] == 4
    assert np.array_equal(video_formats.read_raw(data, 4, height_px=4), nv12)
    with pytest.raises(WireError, match="wanted 384"):
        video_formats.read_raw(data[:-1], 4, height_px=4)


def joint(start: float, accuracy: int) -> bytes:
    """36 bytes: orientation, position, radius, accuracy."""
    return le("8f", *[start + k for k in range(8)]) + le("i", accuracy)


def test_spatial_input():
    left = b"".join(joint(k, 0) for k in range(26))
    right = b"".join(joint(100 + k, 1) for k in range(26))
    data = le("I", 1 | 4) + le("9f", *range(9)) + le("6f", *range(20, 26)) + left + right
    assert len(data) == 1936
    found = spatial_input.read_input(data)
    assert found.valid == Valid.HEAD | Valid.LEFT
    assert found.head[0].tolist() == [0, 1, 2]
    assert found.head[2].tolist() == [6, 7, 8]
    assert found.eyes[1].tolist() == [23, 24, 25]
    assert found.left["orientation"][2].tolist() == [2, 3, 4, 5]
    assert found.left["position"][2].tolist() == [6, 7, 8]
    assert found.right["radius"][25] == 132.0
    assert found.right["accuracy"].tolist() == [1] * 26
    assert spatial_input.encode_input(found) == data
    with pytest.raises(WireError, match="wanted 1936"):
        spatial_input.read_input(data[:-1])


MAPPING = {
    "volumes": (
        SetVolumes(
            (
                Volume(VolumeKind.BOX, (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)),
                Volume(VolumeKind.FRUSTUM, tuple(map(float, range(24)))),
                Volume(VolumeKind.ORIENTED_BOX, tuple(map(float, range(10)))),
                Volume(VolumeKind.SPHERE, (1.0, 2.0, 3.0, 4.0)),
            )
        ),
        b"\x00\x04"
        + le("I6f", 0, *range(6))
        + le("I24f", 1, *range(24))
        + le("I10f", 2, *range(10))
        + le("I4f", 3, 1, 2, 3, 4),
    ),
    "list": (ListSurfaces(), b"\x01"),
    "meshes": (
        GetMeshes((MeshRequest(GUID, 500.0, 2, 57, 31),)),
        b"\x02" + le("I", 1) + GUID + le("d", 500.0) + le("4I", 2, 57, 31, 0),
    ),
}


@pytest.mark.parametrize("name", MAPPING)
def test_requests_of_spatial_mapping(name):
    request, data = MAPPING[name]
    assert spatial_mapping.encode_request(request) == data
    assert spatial_mapping.read_request(FromMemory(data)) == request


def test_lists_of_surfaces():
    surfaces = (ObservedSurface(GUID, 134_000_000_000_000_000), ObservedSurface(bytes(16), -1))
    data = le("I", 2) + GUID + le("q", 134_000_000_000_000_000) + bytes(16) + le("q", -1)
    assert spatial_mapping.encode_surfaces(surfaces) == data
    assert spatial_mapping.read_surfaces(FromMemory(data)) == surfaces
    with pytest.raises(WireError, match="limit 4096"):
        spatial_mapping.read_surfaces(FromMemory(le("I", 4097)))


def test_meshes_and_their_numbers():
    vertices = le("12h", 32767, 0, 0, 32767, 0, 16384, 0, 32767, 0, 0, -32767, 32767)
    indices = le("3I", 0, 1, 2)
    normals = le("12b", 127, 0, 0, 0, 0, 127, 0, 0, 0, 0, -127, 0)
    bounds = [float(k) for k in range(10)]
    header = (
        le("5I", 7, 0, len(vertices), len(indices), len(normals))
        + le("3f", 2.0, 3.0, 4.0)
        + le("16f", *ROWS)
        + le("10f", *bounds)
    )
    assert len(header) == 136
    data = header + vertices + indices + normals
    mesh = surface_mesh.read_mesh(FromMemory(data))
    assert (mesh.index, mesh.status, mesh.scale) == (7, MeshStatus.OK, (2.0, 3.0, 4.0))
    assert mesh.pose[3].tolist() == [13, 14, 15, 16]
    assert mesh.bounds == tuple(bounds)
    assert surface_mesh.encode_mesh(mesh) == data
    numbers = surface_mesh.numbers_of(mesh, MeshRequest(GUID))
    wanted = [[2, 0, 0], [0, 3 * 16384 / 32767, 0], [0, 0, -4]]
    assert np.allclose(numbers.vertices_m, wanted)
    assert np.allclose(numbers.normals, [[1, 0, 0], [0, 1, 0], [0, 0, -1]])
    assert numbers.triangles.tolist() == [[0, 1, 2]]


def test_a_mesh_that_is_not_there_has_no_body():
    data = le("5I", 1, 1, 0, 0, 0) + le("3f16f10f", *[0.0] * 29)
    mesh = surface_mesh.read_mesh(FromMemory(data + b"next"))
    assert mesh.status is MeshStatus.UNKNOWN_ID
    assert mesh.vertices == b""
    assert len(surface_mesh.encode_mesh(MeshReply(1, MeshStatus.UNKNOWN_ID))) == 136


@pytest.mark.parametrize("formats", [(13, 42, 31), (2, 57, 2), (2, 42, 31), (13, 57, 2)])
def test_meshes_come_back_in_every_format(formats):
    rng = np.random.default_rng(1)
    numbers = surface_mesh.MeshNumbers(
        rng.uniform(-2, 2, (40, 3)),
        rng.integers(0, 40, (20, 3)).astype(np.int32),
        np.tile([0.0, 0.6, -0.8], (40, 1)),
    )
    request = MeshRequest(GUID, 1.0, *formats)
    sent = surface_mesh.reply_with(numbers, request, index=0, pose=np.eye(4))
    came = surface_mesh.read_mesh(FromMemory(surface_mesh.encode_mesh(sent)))
    found = surface_mesh.numbers_of(came, request)
    assert np.allclose(found.vertices_m, numbers.vertices_m, atol=1e-4)
    assert np.allclose(found.normals, numbers.normals, atol=5e-3)
    assert np.array_equal(found.triangles, numbers.triangles)


CONFIGURATION = {
    Setting.VERSION: ((), b"", (1, 0, 37, 0), "4H"),
    Setting.UTC_OFFSET: ((), b"", (133_000_000_000_000_000,), "Q"),
    Setting.MARKER_STATE: ((1,), le("I", 1), (), ""),
    Setting.VIDEO_STATUS: ((), b"", (1,), "B"),
    Setting.FOCUS: ((1, 2, 3, 4, 5), le("5I", 1, 2, 3, 4, 5), (), ""),
    Setting.TEMPORAL_DENOISING: ((1,), le("I", 1), (), ""),
    Setting.WHITE_BALANCE_PRESET: ((2,), le("I", 2), (), ""),
    Setting.WHITE_BALANCE_VALUE: ((4500,), le("I", 4500), (), ""),
    Setting.EXPOSURE: ((0, 100), le("2I", 0, 100), (), ""),
    Setting.EXPOSURE_PRIORITY: ((1,), le("I", 1), (), ""),
    Setting.ISO_SPEED: ((1, 800), le("2I", 1, 800), (), ""),
    Setting.BACKLIGHT: ((1,), le("I", 1), (), ""),
    Setting.SCENE_MODE: ((3,), le("I", 3), (), ""),
    Setting.FLAT_MODE: ((1,), le("I", 1), (), ""),
    Setting.EYE_SELECTION: ((1,), le("I", 1), (), ""),
    Setting.OPTIMIZATION: ((2,), le("I", 2), (), ""),
    Setting.PRIMARY_USE: ((1,), le("I", 1), (), ""),
    Setting.OPTICAL_STABILIZATION: ((1,), le("I", 1), (), ""),
    Setting.HDR_VIDEO: ((1,), le("I", 1), (), ""),
    Setting.REGION_OF_INTEREST: ((1, 0.0, 0.25, 0.5, 1.0), le("I4f", 1, 0, 0.25, 0.5, 1), (), ""),
    Setting.PORT_PRIORITY: ((3810, -2), le("Ii", 3810, -2), (), ""),
    Setting.QUIET: ((1,), le("I", 1), (), ""),
    Setting.TIME: ((1,), le("I", 1), (134_000_000_000_000_000,), "Q"),
    Setting.INPUT_DELAY: ((-5,), le("q", -5), (), ""),
    Setting.ENCODER_BUFFERING: ((1,), le("I", 1), (), ""),
    Setting.READER_BUFFERING: ((1,), le("I", 1), (), ""),
    Setting.LOOP_CONTROL: ((3812, 1), le("2I", 3812, 1), (), ""),
}
NUMBERS = [*range(0x1A), 0x20, 0x21, 0x22]


@pytest.mark.parametrize("setting", CONFIGURATION)
def test_remote_configuration(setting):
    values, body, answer, layout = CONFIGURATION[setting]
    data = bytes([int(setting)]) + body
    request = Request(setting, values)
    assert remote_configuration.encode_request(request) == data
    assert remote_configuration.read_request(FromMemory(data)) == request
    reply = le(layout, *answer)
    assert remote_configuration.encode_reply(request, answer) == reply
    assert remote_configuration.read_reply(FromMemory(reply), request) == answer


def test_the_numbers_of_settings_are_those_of_the_table():
    assert sorted(int(setting) for setting in Setting) == NUMBERS
    assert set(CONFIGURATION) | {Setting.MAP_POINTS, Setting.RIG_POSES} == set(Setting)


def test_points_and_rig_poses_are_counted():
    points = Request(Setting.MAP_POINTS, (3800, 0, 2), (1.0, 2.0, 3.0, 4.0))
    data = b"\x16" + le("3I", 3800, 0, 2) + le("4f", 1, 2, 3, 4)
    assert remote_configuration.encode_request(points) == data
    assert remote_configuration.read_request(FromMemory(data)) == points
    assert remote_configuration.reply_layout(points).size == 16
    times = Request(Setting.RIG_POSES, (2,), (5, 6))
    data = b"\x17" + le("I", 2) + le("2Q", 5, 6)
    assert remote_configuration.encode_request(times) == data
    assert remote_configuration.read_request(FromMemory(data)) == times
    assert remote_configuration.reply_layout(times).size == 2 * 64
    with pytest.raises(WireError, match="limit 4096"):
        remote_configuration.read_request(FromMemory(b"\x17" + le("I", 5000)))


NUMBERS10 = [float(k) for k in range(10)]
ORDERS = [
    (Order(Command.CREATE_PRIMITIVE, (3,)), 0, le("I", 3)),
    (Order(Command.SET_ACTIVE, (-7, 1)), 1, le("iI", -7, 1)),
    (Order(Command.SET_WORLD_TRANSFORM, (5, *NUMBERS10)), 2, le("i10f", 5, *NUMBERS10)),
    (Order(Command.SET_LOCAL_TRANSFORM, (5, *NUMBERS10)), 3, le("i10f", 5, *NUMBERS10)),
    (Order(Command.SET_COLOR, (5, 1.0, 0.5, 0.0, 1.0)), 4, le("i4f", 5, 1, 0.5, 0, 1)),
    (Order(Command.SET_TEXTURE, (5,), b"\x89PNG"), 5, le("i", 5) + b"\x89PNG"),
    (Order(Command.CREATE_TEXT), 6, b""),
    (
        Order(Command.SET_TEXT, (5, 0.5, 1.0, 1.0, 1.0, 1.0), "süß".encode()),
        7,
        le("if4f", 5, 0.5, 1, 1, 1, 1) + "süß".encode(),
    ),
    (Order(Command.SAY, (), b"hello"), 8, b"hello"),
    (Order(Command.LOAD_MESH, (), b"mesh"), 15, b"mesh"),
    (Order(Command.REMOVE, (5,)), 16, le("i", 5)),
    (Order(Command.REMOVE_ALL), 17, b""),
    (Order(Command.BEGIN_DISPLAY_LIST), 18, b""),
    (Order(Command.END_DISPLAY_LIST), 19, b""),
    (Order(Command.SET_TARGET_MODE, (1,)), 20, le("I", 1)),
    (Order(Command.DISCONNECT), 0xFFFFFFFF, b""),
]


@pytest.mark.parametrize(
    ("order", "number", "body"), ORDERS, ids=lambda v: getattr(v, "command", None)
)
def test_message_queue(order, number, body):
    data = le("2I", number, len(body)) + body
    assert message_queue.encode_order(order) == data
    assert message_queue.read_order(FromMemory(data)) == order


def test_results_and_keys():
    assert message_queue.encode_result(101) == le("I", 101)
    assert message_queue.encode_result(-7) == le("i", -7)
    assert message_queue.read_result(FromMemory(le("i", -7))) == 0xFFFFFFF9
    assert message_queue.key_of(0xFFFFFFF9) == -7
    assert message_queue.key_of(101) == 101
    with pytest.raises(WireError, match="result 0"):
        message_queue.key_of(0)


def test_commands_that_nobody_knows_are_read_and_left():
    data = le("2I", 99, 3) + b"abc" + le("2I", 17, 0)
    take = FromMemory(data)
    assert message_queue.read_order(take) == message_queue.UnknownOrder(99, 3)
    assert message_queue.read_order(take) == Order(Command.REMOVE_ALL)
    with pytest.raises(WireError, match="limit"):
        message_queue.read_order(FromMemory(le("2I", 8, 1 << 30)))


WHOLE = [
    *((personal_video.read_opening, data) for _, data in OPENINGS.values()),
    *((spatial_mapping.read_request, data) for _, data in MAPPING.values()),
    *((message_queue.read_order, le("2I", n, len(b)) + b) for _, n, b in ORDERS),
    *(
        (remote_configuration.read_request, bytes([int(s)]) + body)
        for s, (_, body, _, _) in CONFIGURATION.items()
    ),
    (spatial_mapping.read_surfaces, le("I", 1) + bytes(24)),
    (surface_mesh.read_mesh, le("5I", 0, 0, 8, 2, 4) + bytes(116) + bytes(14)),
    (video_formats.read_calibration, bytes(208)),
]


@pytest.mark.parametrize(("read", "data"), WHOLE)
def test_every_message_cut_at_every_byte_is_cut_short(read, data):
    for end in range(len(data)):
        with pytest.raises(CutShortError):
            read(FromMemory(data[:end]))
    take = FromMemory(data)
    read(take)
    assert take.left == 0
