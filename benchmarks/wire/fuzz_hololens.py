"""Parsers of a HoloLens and of its clients, as targets of `fuzz.py`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.wire.fuzz_people import PeopleTarget
from devices.hololens.axes import camera_of, camera_pose, head_and_hands, surface_of
from devices.hololens.wire import (
    message_queue,
    personal_video,
    remote_configuration,
    spatial_input,
    spatial_mapping,
    surface_mesh,
    video_formats,
)
from devices.hololens.wire.message_queue import Command, Order
from devices.hololens.wire.packets import Packet, encode_packet, read_packet
from devices.hololens.wire.personal_video import (
    CalibrationRequest,
    Profile,
    StartVideo,
    StopVideo,
    VideoRequest,
    VideoTrailer,
)
from devices.hololens.wire.remote_configuration import Request, Setting
from devices.hololens.wire.spatial_mapping import (
    GetMeshes,
    ListSurfaces,
    ObservedSurface,
    SetVolumes,
    Volume,
    VolumeKind,
)
from devices.hololens.wire.surface_mesh import MeshNumbers, MeshRequest
from devices.hololens.wire.taking import FromMemory, Take, WireError
from scenes.pose import Pose
from sim.hololens.axes import input_of, nothing_seen
from sim.hololens.wearer import Stroller

MAX_BYTES = 1 << 16
"""Largest payload that packets may have here."""

MESH = MeshRequest(bytes(16))
"""Request whose answers are read."""


def openings() -> tuple[bytes, ...]:
    """Return what clients say at the camera's port."""
    stream = VideoRequest(True, 424, 240, 30, 1, Profile.H264_MAIN, 255, 400_000, ((10, 30),))
    said = (StartVideo(), StopVideo(), CalibrationRequest(424, 240, 30), stream)
    return tuple(personal_video.encode_opening(each) for each in said)


def mapping_requests() -> tuple[bytes, ...]:
    """Return what clients ask for at the mapping's port."""
    box = Volume(VolumeKind.BOX, (0.0, 0.0, 0.0, 8.0, 8.0, 8.0))
    ball = Volume(VolumeKind.SPHERE, (0.0, 0.0, 0.0, 4.0))
    asked = (SetVolumes((box, ball)), ListSurfaces(), GetMeshes((MESH, MESH)))
    return tuple(spatial_mapping.encode_request(each) for each in asked)


def orders() -> tuple[bytes, ...]:
    """Return what clients send to the display's port."""
    numbers = (0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.1, 0.1, 0.1)
    said = (
        Order(Command.BEGIN_DISPLAY_LIST),
        Order(Command.CREATE_PRIMITIVE, (3,)),
        Order(Command.SET_TARGET_MODE, (1,)),
        Order(Command.SET_WORLD_TRANSFORM, (0, *numbers)),
        Order(Command.SET_COLOR, (0, 1.0, 0.0, 0.0, 1.0)),
        Order(Command.CREATE_TEXT),
        Order(Command.SET_TEXT, (0, 0.4, 1.0, 1.0, 1.0, 1.0), b"hello"),
        Order(Command.REMOVE_ALL),
        Order(Command.END_DISPLAY_LIST),
    )
    return tuple(map(message_queue.encode_order, said))


def settings() -> tuple[bytes, ...]:
    """Return what clients ask at the configuration's port."""
    asked = (
        Request(Setting.VERSION),
        Request(Setting.TIME, (0,)),
        Request(Setting.VIDEO_STATUS),
        Request(Setting.FOCUS, (1, 2, 3, 4, 5)),
        Request(Setting.MAP_POINTS, (3800, 0, 2), (1.0, 2.0, 3.0, 4.0)),
        Request(Setting.RIG_POSES, (1,), (987_654_321_000,)),
    )
    return tuple(map(remote_configuration.encode_request, asked))


def body_packets() -> tuple[bytes, ...]:
    """Return what a headset sends of head and hands."""
    sample = input_of(Stroller(0).at(1.0), Pose.identity(), before=nothing_seen())
    samples = (sample, nothing_seen())
    return tuple(encode_packet(Packet(5, spatial_input.encode_input(each))) for each in samples)


def video_packets() -> tuple[bytes, ...]:
    """Return what a headset sends of its camera."""
    trailer = personal_video.encode_trailer(VideoTrailer((300.0, 300.0), (212.0, 120.0), 424, 240))
    unit = personal_video.ACCESS_UNIT_DELIMITER + b"\x00\x00\x00\x01\x67 and a picture"
    pose = np.eye(4, dtype=np.float32)
    return (
        encode_packet(Packet(5, unit + trailer, pose)),
        encode_packet(Packet(6, trailer, np.zeros((4, 4), np.float32))),
    )


def surface_lists() -> tuple[bytes, ...]:
    """Return what a headset answers of its surfaces."""
    some = [ObservedSurface(bytes([k] * 16), 10**17 + k) for k in range(3)]
    return (spatial_mapping.encode_surfaces(some), spatial_mapping.encode_surfaces([]))


def meshes() -> tuple[bytes, ...]:
    """Return what a headset answers with a surface's mesh."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    numbers = MeshNumbers(
        corners, np.array([[0, 1, 2]], np.int32), np.tile([0.0, 0.0, 1.0], (3, 1))
    )
    reply = surface_mesh.reply_with(numbers, MESH, index=0, pose=np.eye(4))
    missing = surface_mesh.MeshReply(1, surface_mesh.MeshStatus.UNKNOWN_ID)
    return (surface_mesh.encode_mesh(reply), surface_mesh.encode_mesh(missing))


def hololens_targets() -> Mapping[str, PeopleTarget]:
    """Return all of them by name."""
    refused = (WireError,)
    calibration = np.arange(52, dtype="<f4").tobytes()
    return {
        "HoloLens: camera's clients": (openings(), _from(personal_video.read_opening), refused),
        "HoloLens: mapping's clients": (
            mapping_requests(),
            _from(spatial_mapping.read_request),
            refused,
        ),
        "HoloLens: display's clients": (orders(), _from(message_queue.read_order), refused),
        "HoloLens: configuration's clients": (
            settings(),
            _from(remote_configuration.read_request),
            refused,
        ),
        "HoloLens: head and hands": (body_packets(), _read_body, refused),
        "HoloLens: video": (video_packets(), _read_video, refused),
        "HoloLens: surfaces": (surface_lists(), _from(spatial_mapping.read_surfaces), refused),
        "HoloLens: meshes": (meshes(), _read_mesh, refused),
        "HoloLens: calibrations": (
            (calibration,),
            _from(video_formats.read_calibration),
            refused,
        ),
    }


def _from(read: Callable[[Take], object]) -> Callable[[bytes], object]:
    """Read as many messages as the bytes hold."""

    def all_of(data: bytes) -> object:
        take = FromMemory(data)
        found = read(take)
        while take.left:
            found = read(take)
        return found

    return all_of


def _read_body(data: bytes) -> object:
    packet = read_packet(FromMemory(data), has_pose=False, max_bytes=MAX_BYTES)
    sample = spatial_input.read_input(packet.payload)
    return head_and_hands(sample, seq=0, t_ns=0, arrived_ns=0)


def _read_video(data: bytes) -> object:
    packet = read_packet(FromMemory(data), has_pose=True, max_bytes=MAX_BYTES)
    unit, trailer = personal_video.read_payload(packet.payload)
    return camera_pose(packet), camera_of(trailer, 424, height_px=240), len(unit)


def _read_mesh(data: bytes) -> object:
    reply = surface_mesh.read_mesh(FromMemory(data))
    numbers = surface_mesh.numbers_of(reply, MESH)
    return surface_of(ObservedSurface(bytes(16), 0), numbers, pose=reply.pose, t_ns=0)
